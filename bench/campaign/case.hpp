// One run of the campaign: a scene, and what simulates it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/scene.hpp"

namespace fathom::campaign {

inline constexpr std::uint64_t published_steps = 1800;  // 30 s, section 4.2 of the dissertation
inline constexpr int published_ahead = 2;               // steps, from the same section

struct Case {
  std::string environment;
  std::int64_t bodies = 0;  ///< as requested; a scene may have fewer (`spread` is a square)
  std::string simulator;    ///< a name of `simulators()`
  std::string device;       ///< of simulators that use one, as in `WorldDef::device`
  int threads = 1;
  std::string set;  ///< a name of `algorithm_sets()`
  int round = 1;    ///< repetition of the same case

  bool operator==(const Case&) const = default;
};

/// Unique among a campaign's cases, and usable as a file name: "layers-1000-device-host-2t-dissertation".
std::string key_of(const Case& what);
/// The simulator, for tables and legends: "native, 2 threads, dissertation".
std::string label_of(const Case& what);

struct SimulatorName {
  std::string_view name;
  SimulatorKind kind;
  bool uses_device;
};
std::span<const SimulatorName> simulators();

/// A choice of algorithms for every stage.
struct AlgorithmSet {
  std::string_view name;
  std::string_view about;
  Preset preset;
};
std::span<const AlgorithmSet> algorithm_sets();

/// The case's scene, with its world set up. Throws `Error{invalid_argument}` for unknown names.
Scene make_scene(const Case& what);

}  // namespace fathom::campaign
