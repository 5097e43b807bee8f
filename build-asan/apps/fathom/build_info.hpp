// Written by CMake.
#pragma once

namespace fathom::build_info {

inline constexpr char version[] = "0.1.0";
inline constexpr char commit[] = "98593c9de773";
inline constexpr char compiler[] = "GNU 12.2.0";
inline constexpr char build_type[] = "RelWithDebInfo";

}  // namespace fathom::build_info
