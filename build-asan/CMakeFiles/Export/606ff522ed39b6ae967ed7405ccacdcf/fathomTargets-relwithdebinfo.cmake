#----------------------------------------------------------------
# Generated CMake target import file for configuration "RelWithDebInfo".
#----------------------------------------------------------------

# Commands may need to know the format version.
set(CMAKE_IMPORT_FILE_VERSION 1)

# Import target "fathom::fathom" for configuration "RelWithDebInfo"
set_property(TARGET fathom::fathom APPEND PROPERTY IMPORTED_CONFIGURATIONS RELWITHDEBINFO)
set_target_properties(fathom::fathom PROPERTIES
  IMPORTED_LINK_INTERFACE_LANGUAGES_RELWITHDEBINFO "CXX"
  IMPORTED_LOCATION_RELWITHDEBINFO "${_IMPORT_PREFIX}/lib/libfathom.a"
  )

list(APPEND _cmake_import_check_targets fathom::fathom )
list(APPEND _cmake_import_check_files_for_fathom::fathom "${_IMPORT_PREFIX}/lib/libfathom.a" )

# Commands beyond this point should not need to know the version.
set(CMAKE_IMPORT_FILE_VERSION)
