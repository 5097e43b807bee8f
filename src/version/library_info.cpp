#include <fathom/version.hpp>
#include <string_view>

#include "check/check.hpp"
#include "native/solver_kernels.hpp"

#define FATHOM_TEXT_OF(x) #x
#define FATHOM_TEXT(x) FATHOM_TEXT_OF(x)

namespace fathom {

// CMake defines FATHOM_COMPILER and FATHOM_BUILD_TYPE for this file.
LibraryInfo library_info() {
  LibraryInfo info;
  info.version = FATHOM_VERSION;
  info.text =
      FATHOM_TEXT(FATHOM_VERSION_MAJOR) "." FATHOM_TEXT(FATHOM_VERSION_MINOR) "." FATHOM_TEXT(FATHOM_VERSION_PATCH);
  info.compiler = FATHOM_COMPILER;
  info.type = FATHOM_BUILD_TYPE;
#if defined(FATHOM_SHARED)
  info.linkage = "shared";
#else
  info.linkage = "static";
#endif
  info.checks = FATHOM_CHECKS;
  // AVX3 is Highway's name for AVX-512.
  const std::string_view simd = native::wide_kernels().name;
  info.simd = simd == "AVX3" ? "AVX-512" : native::wide_kernels().name;
  info.back_ends =
      "host"
#if defined(FATHOM_HAS_CUDA)
      " cuda"
#endif
#if defined(FATHOM_HAS_SYCL)
      " sycl"
#endif
      ;
  return info;
}

}  // namespace fathom
