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

# Compiles these sources of the target with the SYCL compiler, whose warnings differ from the host compiler's.
function(fathom_sycl_sources target)
  set_source_files_properties(${ARGN} PROPERTIES COMPILE_DEFINITIONS FATHOM_SYCL_SOURCE
    COMPILE_OPTIONS "-Wno-error;-Wno-unknown-warning-option")
  add_sycl_to_target(TARGET ${target} SOURCES ${ARGN})
endfunction()

function(fathom_add_sycl target)
  set(sources ${PROJECT_SOURCE_DIR}/src/exec/sycl/sycl_device.cpp ${PROJECT_SOURCE_DIR}/src/device/make_sycl.cpp)
  target_sources(${target} PRIVATE ${sources})
  target_compile_definitions(${target} PRIVATE FATHOM_HAS_SYCL)
  fathom_sycl_sources(${target} ${sources})
endfunction()
