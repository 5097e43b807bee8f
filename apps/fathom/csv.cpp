#include "csv.hpp"

#include <fmt/format.h>

#include <ostream>

namespace fathom::cli {

void write_csv_head(std::ostream& out) {
  out << "step,step_ms,find_pairs_ms,update_manifolds_ms,build_constraints_ms,solve_ms,finish_ms,"
         "bodies,active,pairs,manifolds,points,colours,overflow,islands,recycled,quarantined,"
         "launches,bytes_to_device,bytes_to_host,memory_bytes\n";
}

void write_csv_row(std::ostream& out, const Profile& profile, double step_ms) {
  const StageTimes& t = profile.times;
  const StepCounts& c = profile.counts;
  out << fmt::format("{},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},", profile.step, step_ms, t.find_pairs,
                     t.update_manifolds, t.build_constraints, t.solve, t.finish)
      << fmt::format("{},{},{},{},{},{},{},{},{},{},", c.bodies, c.active, c.pairs, c.manifolds, c.points, c.colours,
                     c.overflow, c.islands, c.recycled, c.quarantined)
      << fmt::format("{},{},{},{}\n", c.launches, c.bytes_to_device, c.bytes_to_host, c.memory_bytes);
}

}  // namespace fathom::cli
