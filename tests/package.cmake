# Makes the Debian packages of a build and looks at what they hold.
#   cmake -D FATHOM_BUILD=… -D WORK=… -P package.cmake
find_program(CPACK cpack REQUIRED)
find_program(DPKG_DEB dpkg-deb REQUIRED)

file(REMOVE_RECURSE "${WORK}")
execute_process(COMMAND "${CPACK}" -G DEB --config "${FATHOM_BUILD}/CPackConfig.cmake" -B "${WORK}"
  WORKING_DIRECTORY "${FATHOM_BUILD}" RESULT_VARIABLE result OUTPUT_VARIABLE said ERROR_VARIABLE said)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "cpack -G DEB failed:\n${said}")
endif()

# must_hold(<package> <path>…): each path, a regular expression, is in the one package of that name.
function(must_hold package)
  file(GLOB debs "${WORK}/${package}_*.deb")
  list(LENGTH debs count)
  if(NOT count EQUAL 1)
    message(FATAL_ERROR "${count} packages ${package}")
  endif()
  execute_process(COMMAND "${DPKG_DEB}" --contents "${debs}" OUTPUT_VARIABLE contents COMMAND_ERROR_IS_FATAL ANY)
  foreach(path ${ARGN})
    if(NOT contents MATCHES "\\./usr/${path}\n")
      message(FATAL_ERROR "${package} lacks usr/${path}; it holds\n${contents}")
    endif()
  endforeach()
endfunction()

must_hold(libfathom-dev include/fathom/world\\.hpp lib/libfathom\\.a lib/pkgconfig/fathom\\.pc
  lib/cmake/fathom/fathomConfig\\.cmake share/doc/libfathom-dev/copyright share/doc/libfathom-dev/docs/tutorial\\.md
  share/doc/libfathom-dev/examples/scenes/joints\\.toml)
if(PROGRAM)
  must_hold(fathom bin/fathom share/doc/fathom/copyright)
endif()
