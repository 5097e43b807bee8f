# Flags every target of this project is built with.
function(fathom_target target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wdouble-promotion
    $<$<BOOL:${FATHOM_WARNINGS_AS_ERRORS}>:-Werror>
    # g++ 12 sees overlaps in every "literal" + std::string (GCC bug 105651).
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>
    # Same bits on every compiler and target: no contraction of a·b + c behind our back.
    -ffp-contract=off -fno-math-errno -fno-trapping-math)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    # The floor: AVX2 and fma. Wider code is chosen at run time (src/native).
    target_compile_options(${target} PRIVATE -march=x86-64-v3)
  endif()
  if(FATHOM_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${FATHOM_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${FATHOM_SANITIZE})
    if(FATHOM_SANITIZE MATCHES "undefined")
      target_compile_options(${target} PRIVATE -fno-sanitize-recover=undefined)
      # Checking every lane access of the constraint kernels takes g++ longer than all the rest; address checks stay.
      set_source_files_properties(src/native/solver_kernels.cpp PROPERTIES COMPILE_OPTIONS -fno-sanitize=undefined)
    endif()
  endif()
endfunction()
