# Installs Fathom: the library (find_package(fathom), pkg-config), its components engine and render, the program, texts.
# CPack makes packages of the same parts: `cpack` in the build folder.
include(CMakePackageConfigHelpers)

set(FATHOM_PACKAGE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/fathom")

# fathom_install_library(<target> <name> <export set>): users know it as fathom::<name>.
function(fathom_install_library target name set)
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS ${target} EXPORT ${set}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT dev
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT library)
endfunction()

# fathom_install_export(<export set>): the file that describes these targets.
function(fathom_install_export set)
  install(EXPORT ${set} NAMESPACE fathom:: DESTINATION ${FATHOM_PACKAGE_DIR} COMPONENT dev)
endfunction()

# fathom_install_headers(<header of src>…)
function(fathom_install_headers)
  foreach(header IN LISTS ARGN)
    get_filename_component(folder "${header}" DIRECTORY)
    install(FILES "${PROJECT_SOURCE_DIR}/src/${header}" DESTINATION "${FATHOM_COMPONENT_INCLUDES}/${folder}"
      COMPONENT dev)
  endforeach()
endfunction()

fathom_install_library(fathom fathom fathomTargets)
install(DIRECTORY include/fathom DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev)
fathom_install_export(fathomTargets)

set(FATHOM_COMPONENTS "")
if(TARGET fathom_engine)
  fathom_install_library(fathom_files files fathomFilesTargets)
  fathom_install_export(fathomFilesTargets)
  fathom_install_library(fathom_scene scene fathomEngineTargets)
  fathom_install_library(fathom_engine engine fathomEngineTargets)
  fathom_install_export(fathomEngineTargets)
  foreach(name command command_runner config data_log engine entity entity_world failures front_end input log recording
      scene_entities simulation timers trace)
    fathom_install_headers(engine/${name}.hpp)
  endforeach()
  fathom_install_headers(check/check.hpp scene/environments.hpp scene/random.hpp scene/scene.hpp scene/scene_file.hpp)
  list(APPEND FATHOM_COMPONENTS engine)
endif()
if(TARGET fathom_render)
  fathom_install_library(fathom_render render fathomRenderTargets)
  fathom_install_export(fathomRenderTargets)
  foreach(name camera colour egl_context gl_objects image look mat4 pose_buffer render_target renderer stage video
      web_page world_colours world_picture)
    fathom_install_headers(render/${name}.hpp)
  endforeach()
  fathom_install_headers(files/claim.hpp files/output_file.hpp)
  list(APPEND FATHOM_COMPONENTS render)
endif()

configure_package_config_file(cmake/fathomConfig.cmake.in fathomConfig.cmake INSTALL_DESTINATION ${FATHOM_PACKAGE_DIR})
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(fathomConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/fathomConfig.cmake" "${CMAKE_CURRENT_BINARY_DIR}/fathomConfigVersion.cmake"
  DESTINATION ${FATHOM_PACKAGE_DIR} COMPONENT dev)

# pkg-config, for the library alone. Programs that link the archive link Highway too.
set(FATHOM_PC_CFLAGS "")
set(FATHOM_PC_REQUIRES "")
if(BUILD_SHARED_LIBS)
  set(FATHOM_PC_CFLAGS " -DFATHOM_SHARED")
else()
  set(FATHOM_PC_REQUIRES "Requires: libhwy")
endif()
if(NOT FATHOM_WITH_CUDA AND NOT FATHOM_WITH_SYCL OR BUILD_SHARED_LIBS)
  file(RELATIVE_PATH FATHOM_PC_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
  configure_file(cmake/fathom.pc.in fathom.pc @ONLY)
  install(FILES "${CMAKE_CURRENT_BINARY_DIR}/fathom.pc" DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endif()

# Texts: what every package must have, the licence as Debian names it, and what developers read. Their pages link to
# examples and headers beside them.
set(FATHOM_DOC "${CMAKE_INSTALL_DATADIR}/doc")
set(FATHOM_DEV_DOC "${FATHOM_DOC}/libfathom-dev")
function(fathom_install_licence folder component)
  install(FILES LICENSE DESTINATION ${FATHOM_DOC}/${folder} RENAME copyright COMPONENT ${component})
  install(FILES CHANGELOG.md DESTINATION ${FATHOM_DOC}/${folder} COMPONENT ${component})
endfunction()
if(BUILD_SHARED_LIBS)
  fathom_install_licence(libfathom${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} library)
endif()
fathom_install_licence(libfathom-dev dev)
install(FILES README.md CONTRIBUTING.md DESTINATION ${FATHOM_DEV_DOC} COMPONENT dev)
install(DIRECTORY docs examples DESTINATION ${FATHOM_DEV_DOC} COMPONENT dev PATTERN CMakeLists.txt EXCLUDE)
file(RELATIVE_PATH include_from_doc "/${FATHOM_DEV_DOC}" "/${CMAKE_INSTALL_INCLUDEDIR}")
install(CODE "file(CREATE_LINK \"${include_from_doc}\" \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${FATHOM_DEV_DOC}/include\" SYMBOLIC)"
  COMPONENT dev)
if(TARGET fathom_cli)
  fathom_install_licence(fathom program)
  install(DIRECTORY examples/scenes DESTINATION ${FATHOM_DOC}/fathom COMPONENT program)
endif()

if(PROJECT_IS_TOP_LEVEL)
  include(FathomPackage)
endif()
