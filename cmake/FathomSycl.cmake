# Whether this build has the SYCL back end: sets FATHOM_WITH_SYCL.
set(FATHOM_SYCL AUTO CACHE STRING "SYCL back end: AUTO (where AdaptiveCpp is found), ON or OFF")
set_property(CACHE FATHOM_SYCL PROPERTY STRINGS AUTO ON OFF)

set(FATHOM_WITH_SYCL OFF)
if(NOT FATHOM_SYCL STREQUAL "OFF")
  find_package(AdaptiveCpp CONFIG QUIET)
  if(AdaptiveCpp_FOUND)
    set(FATHOM_WITH_SYCL ON)
  elseif(FATHOM_SYCL STREQUAL "ON")
    message(FATAL_ERROR "FATHOM_SYCL=ON, but AdaptiveCpp was not found. Set AdaptiveCpp_DIR.")
  endif()
endif()
message(STATUS "SYCL back end: ${FATHOM_WITH_SYCL}")

# Compiles the sources with the SYCL compiler and links them into the target. They are a library of objects of their
# own: AdaptiveCpp's launcher replaces the compiler of whole targets.
function(fathom_sycl_sources target)
  set(objects ${target}_sycl)
  add_library(${objects} OBJECT ${ARGN})
  fathom_target(${objects})
  target_include_directories(${objects} PRIVATE $<TARGET_PROPERTY:${target},INCLUDE_DIRECTORIES>)
  # Kernels are submitted from the calling thread at once instead of through a task graph: a third of the latency.
  target_compile_definitions(${objects} PRIVATE FATHOM_SYCL_SOURCE ACPP_ALLOW_INSTANT_SUBMISSION=1)
  # The flags are the host compiler's; this one knows others. Its results are not for ccache, which sees no plugin.
  target_compile_options(${objects} PRIVATE -Wno-error -Wno-unknown-warning-option
    -Wno-deprecated-declarations)
  set_target_properties(${objects} PROPERTIES CXX_COMPILER_LAUNCHER "")
  add_sycl_to_target(TARGET ${objects} SOURCES ${ARGN})
  target_sources(${target} PRIVATE $<TARGET_OBJECTS:${objects}>)
  target_link_libraries(${target} PRIVATE AdaptiveCpp::acpp-rt)
endfunction()

function(fathom_add_sycl target)
  set(sources ${PROJECT_SOURCE_DIR}/src/exec/sycl/sycl_device.cpp ${PROJECT_SOURCE_DIR}/src/device/make_sycl.cpp
    ${PROJECT_SOURCE_DIR}/src/device/queries_sycl.cpp)
  fathom_sycl_sources(${target} ${sources})
  target_compile_definitions(${target} PRIVATE FATHOM_HAS_SYCL)
  # On NVIDIA GPUs events and graphs are those of the queue's CUDA stream.
  if(NOT FATHOM_WITH_CUDA)
    find_package(CUDAToolkit QUIET)
    if(CUDAToolkit_FOUND)
      target_sources(${target} PRIVATE ${FATHOM_CUDA_STREAM_SOURCES})
      target_link_libraries(${target} PRIVATE CUDA::cudart_static)
    else()
      target_sources(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src/exec/cuda/stream_absent.cpp)
    endif()
  endif()
endfunction()
