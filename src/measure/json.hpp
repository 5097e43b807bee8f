// Statistics and quality as JSON, with the same keys in all of Fathom's files.
#pragma once

#include <nlohmann/json.hpp>

#include "measure/statistics.hpp"
#include "scene/quality.hpp"

namespace fathom {

/// For any JSON type: some keep the order of keys.
template <class Json>
Json json_of(const Statistics& s) {
  return {{"mean", s.mean}, {"median", s.median}, {"p99", s.p99}, {"max", s.max}};
}

template <class Json>
Json json_of(const Quality& q) {
  return {{"ground_penetration_max", q.ground_penetration_max},
          {"displacement_max", q.displacement_max},
          {"top_drop", q.top_drop},
          {"kinetic_energy_per_body", q.kinetic_energy_per_body},
          {"bodies_below_ground", q.bodies_below_ground},
          {"overlap_max", q.overlap_max},
          {"joint_gap_max", q.joint_gap_max},
          {"escaped", q.escaped},
          {"non_finite", q.non_finite}};
}

}  // namespace fathom
