# Whether this build has the CUDA back end: sets FATHOM_WITH_CUDA.
# Off unless asked for: nvcc takes minutes.
set(FATHOM_CUDA OFF CACHE STRING "CUDA back end: AUTO (where nvcc is found), ON or OFF")
set_property(CACHE FATHOM_CUDA PROPERTY STRINGS AUTO ON OFF)

set(FATHOM_WITH_CUDA OFF)
# Sanitizers see host code only: AUTO leaves CUDA out of such builds.
if(FATHOM_CUDA STREQUAL "AUTO" AND NOT FATHOM_SANITIZE OR FATHOM_CUDA STREQUAL "ON")
  if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES)
    # Turing, Ampere, Hopper; the last also as PTX, for what comes later.
    set(CMAKE_CUDA_ARCHITECTURES "75-real;80-real;90" CACHE STRING "CUDA architectures")
  endif()
  if(NOT DEFINED CMAKE_CUDA_HOST_COMPILER AND NOT DEFINED ENV{CUDAHOSTCXX})
    # One compiler for all host code.
    set(CMAKE_CUDA_HOST_COMPILER "${CMAKE_CXX_COMPILER}" CACHE FILEPATH "Host compiler of nvcc")
  endif()
  if(NOT DEFINED CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX})
    # The toolkit's usual place, which is often not on the search path.
    find_program(FATHOM_NVCC nvcc HINTS /usr/local/cuda/bin /opt/cuda/bin)
    mark_as_advanced(FATHOM_NVCC)
    if(FATHOM_NVCC)
      set(CMAKE_CUDA_COMPILER "${FATHOM_NVCC}")
    endif()
  endif()
  include(CheckLanguage)
  check_language(CUDA)
  if(CMAKE_CUDA_COMPILER)
    enable_language(CUDA)
    find_package(CUDAToolkit REQUIRED)
    set(FATHOM_WITH_CUDA ON)
    if(CCACHE_PROGRAM AND NOT CMAKE_CUDA_COMPILER_LAUNCHER)
      set(CMAKE_CUDA_COMPILER_LAUNCHER "${CCACHE_PROGRAM}")
    endif()
  elseif(FATHOM_CUDA STREQUAL "ON")
    message(FATAL_ERROR "FATHOM_CUDA=ON, but no working nvcc was found. Set CMAKE_CUDA_COMPILER to its path.")
  endif()
endif()
message(STATUS "CUDA back end: ${FATHOM_WITH_CUDA}")

# Host code that drives a stream, for the SYCL back end too.
set(FATHOM_CUDA_STREAM_SOURCES ${PROJECT_SOURCE_DIR}/src/exec/cuda/check.cpp ${PROJECT_SOURCE_DIR}/src/exec/cuda/stream.cpp)

# Adds the back end's sources to the library. The runtime is linked statically: the same program runs where there is
# no driver, and lists the device as unavailable.
function(fathom_add_cuda target)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/exec/cuda/*.cu
    ${PROJECT_SOURCE_DIR}/src/device/*.cu)
  list(APPEND sources ${FATHOM_CUDA_STREAM_SOURCES})
  target_sources(${target} PRIVATE ${sources})
  target_compile_definitions(${target} PRIVATE FATHOM_HAS_CUDA)
  target_link_libraries(${target} PRIVATE CUDA::cudart_static)
endfunction()
