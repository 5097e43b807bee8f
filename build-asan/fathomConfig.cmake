# find_package(fathom) gives the target fathom::fathom.

####### Expanded from @PACKAGE_INIT@ by configure_package_config_file() #######
####### Any changes to this file will be overwritten by the next CMake run ####
####### The input file was fathomConfig.cmake.in                            ########

get_filename_component(PACKAGE_PREFIX_DIR "${CMAKE_CURRENT_LIST_DIR}/../../../" ABSOLUTE)

macro(set_and_check _var _file)
  set(${_var} "${_file}")
  if(NOT EXISTS "${_file}")
    message(FATAL_ERROR "File or directory ${_file} referenced by variable ${_var} does not exist !")
  endif()
endmacro()

macro(check_required_components _NAME)
  foreach(comp ${${_NAME}_FIND_COMPONENTS})
    if(NOT ${_NAME}_${comp}_FOUND)
      if(${_NAME}_FIND_REQUIRED_${comp})
        set(${_NAME}_FOUND FALSE)
      endif()
    endif()
  endforeach()
endmacro()

####################################################################################

include(CMakeFindDependencyMacro)
find_dependency(Threads)

# The archive calls Highway; its headers are not needed.
if(NOT TARGET fathom::hwy)
  find_library(FATHOM_HWY_LIBRARY hwy)
  mark_as_advanced(FATHOM_HWY_LIBRARY)
  if(NOT FATHOM_HWY_LIBRARY)
    set(fathom_FOUND FALSE)
    set(fathom_NOT_FOUND_MESSAGE "fathom needs the library Highway: install libhwy-dev or set FATHOM_HWY_LIBRARY")
    return()
  endif()
  add_library(fathom::hwy UNKNOWN IMPORTED)
  set_target_properties(fathom::hwy PROPERTIES IMPORTED_LOCATION "${FATHOM_HWY_LIBRARY}")
endif()

if("OFF")
  find_dependency(CUDAToolkit)
endif()

include("${CMAKE_CURRENT_LIST_DIR}/fathomTargets.cmake")
check_required_components(fathom)
