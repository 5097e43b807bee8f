# Installs the library so that find_package(fathom) finds it.
include(CMakePackageConfigHelpers)

set(FATHOM_PACKAGE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/fathom")
install(TARGETS fathom EXPORT fathomTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/fathom DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT fathomTargets NAMESPACE fathom:: DESTINATION ${FATHOM_PACKAGE_DIR})
configure_package_config_file(cmake/fathomConfig.cmake.in fathomConfig.cmake INSTALL_DESTINATION ${FATHOM_PACKAGE_DIR})
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(fathomConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/fathomConfig.cmake" "${CMAKE_CURRENT_BINARY_DIR}/fathomConfigVersion.cmake"
  DESTINATION ${FATHOM_PACKAGE_DIR})
