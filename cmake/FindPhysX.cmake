# FindPhysX: NVIDIA PhysX 5 built as static libraries, whose own build installs no CMake package.
#
#   cmake … -DPhysX_ROOT=<its install prefix>
#
# Gives PhysX::PhysX. PhysX_HAS_GPU says that the libraries can load PhysXGpu; without, the target defines
# DISABLE_CUDA_PHYSX, which PhysX's headers ask for then.
find_path(PhysX_INCLUDE_DIR PxPhysicsAPI.h PATH_SUFFIXES include include/physx)
set(physx_libraries)
# In the order in which they need each other.
foreach(name IN ITEMS PhysXExtensions PhysX PhysXPvdSDK PhysXCooking PhysXCommon PhysXFoundation)
  find_library(PhysX_${name}_LIBRARY NAMES ${name}_static_64 ${name}_static
    PATH_SUFFIXES bin/linux.x86_64/release bin/linux.aarch64/release)
  mark_as_advanced(PhysX_${name}_LIBRARY)
  list(APPEND physx_libraries ${PhysX_${name}_LIBRARY})
endforeach()
mark_as_advanced(PhysX_INCLUDE_DIR)

if(PhysX_INCLUDE_DIR AND EXISTS ${PhysX_INCLUDE_DIR}/foundation/PxPhysicsVersion.h)
  file(STRINGS ${PhysX_INCLUDE_DIR}/foundation/PxPhysicsVersion.h version_lines
    REGEX "define PX_PHYSICS_VERSION_(MAJOR|MINOR|BUGFIX) +[0-9]+")
  string(REGEX REPLACE "[^;0-9]" "" PhysX_VERSION "${version_lines}")
  string(REPLACE ";" "." PhysX_VERSION "${PhysX_VERSION}")
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(PhysX VERSION_VAR PhysX_VERSION
  REQUIRED_VARS PhysX_INCLUDE_DIR PhysX_PhysX_LIBRARY PhysX_PhysXExtensions_LIBRARY PhysX_PhysXCommon_LIBRARY
                PhysX_PhysXFoundation_LIBRARY PhysX_PhysXCooking_LIBRARY PhysX_PhysXPvdSDK_LIBRARY)

if(PhysX_FOUND AND NOT TARGET PhysX::PhysX)
  find_package(Threads REQUIRED)
  set(physx_links ${physx_libraries} Threads::Threads ${CMAKE_DL_LIBS})
  include(CheckCXXSourceCompiles)
  set(CMAKE_REQUIRED_INCLUDES ${PhysX_INCLUDE_DIR})
  set(CMAKE_REQUIRED_LIBRARIES ${physx_links})
  set(CMAKE_REQUIRED_DEFINITIONS -DNDEBUG)
  check_cxx_source_compiles("#include <PxPhysicsAPI.h>
    int main() { return PxCreateCudaContextManager(PxGetFoundation(), {}) == nullptr; }" PhysX_HAS_GPU)
  unset(CMAKE_REQUIRED_INCLUDES)
  unset(CMAKE_REQUIRED_LIBRARIES)
  unset(CMAKE_REQUIRED_DEFINITIONS)
  add_library(PhysX::PhysX INTERFACE IMPORTED)
  set_target_properties(PhysX::PhysX PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES ${PhysX_INCLUDE_DIR}
    INTERFACE_LINK_LIBRARIES "${physx_links}")
  if(NOT PhysX_HAS_GPU)
    set_property(TARGET PhysX::PhysX PROPERTY INTERFACE_COMPILE_DEFINITIONS DISABLE_CUDA_PHYSX)
  endif()
endif()
