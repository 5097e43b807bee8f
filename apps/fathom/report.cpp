#include "report.hpp"

#include <fmt/format.h>

#include "build_info.hpp"
#include "measure/counted.hpp"
#include "measure/json.hpp"
#include "measure/system.hpp"

namespace fathom::cli {
namespace {

Json json_of(const std::vector<double>& series) { return fathom::json_of<Json>(statistics(series)); }

Json json_of(const StepCounts& c) {
  return {{"pairs", c.pairs},
          {"manifolds", c.manifolds},
          {"points", c.points},
          {"active", c.active},
          {"colours", c.colours},
          {"overflow", c.overflow},
          {"unbatched", c.unbatched},
          {"work_groups", c.work_groups},
          {"overlaps", c.overlaps},
          {"islands", c.islands},
          {"recycled", c.recycled},
          {"launches", c.launches},
          {"bytes_to_device", c.bytes_to_device},
          {"bytes_to_host", c.bytes_to_host}};
}

Json build_json() {
  return {{"version", build_info::version},
          {"commit", build_info::commit},
          {"compiler", build_info::compiler},
          {"build_type", build_info::build_type}};
}

std::string timing_row(const std::string& name, const Json& s) {
  return fmt::format("  {:<22}{:>10.3f}{:>10.3f}{:>10.3f}{:>10.3f}\n", name, s["mean"].get<double>(),
                     s["median"].get<double>(), s["p99"].get<double>(), s["max"].get<double>());
}

std::string head_text(const Json& r, const std::string& size_note) {
  return fmt::format("{}: {}{}, {} of {:.5g} s, {}{}\n{} simulator, {}, {} broad phase, {}, {} solver{}, {}\n",
                     r["environment"].get<std::string>(), counted(r["bodies"].get<std::uint64_t>(), "body", "bodies"),
                     size_note, counted(r["steps"].get<std::uint64_t>(), "step"), r["dt"].get<double>(),
                     counted(r["substeps"].get<std::uint64_t>(), "substep"),
                     r["finished"].get<bool>() ? "" : " (interrupted)", r["simulator"].get<std::string>(),
                     counted(r["threads"].get<std::uint64_t>(), "thread"), r["broad_phase"].get<std::string>(),
                     r["partition"].get<std::string>(), r["solver"].get<std::string>(),
                     r["warm_start"].get<bool>() ? "" : " without warm starting", r["device"].get<std::string>());
}

std::string timing_text(const Json& r) {
  const Json& stages = r["stages_ms"];
  return fmt::format("\n  {:<22}{:>10}{:>10}{:>10}{:>10}\n", "time (ms)", "mean", "median", "p99", "max") +
         timing_row("step", r["step_ms"]) + timing_row("broad phase", stages["broad_phase"]) +
         timing_row("narrow phase", stages["narrow_phase"]) +
         timing_row("collision resolution", stages["collision_resolution"]);
}

std::string counts_text(const Json& r) {
  const Json& c = r["counts"];
  return fmt::format("\n  last step              {} pairs, {} manifolds, {} points\n", c["pairs"].get<std::uint64_t>(),
                     c["manifolds"].get<std::uint64_t>(), c["points"].get<std::uint64_t>()) +
         (r["partition"] == "cells"
              ? fmt::format("  cells                  {} work-groups, {} batches, {} unbatched\n",
                            c["work_groups"].get<std::uint64_t>(), c["colours"].get<std::uint64_t>(),
                            c["unbatched"].get<std::uint64_t>())
              : std::string()) +
         fmt::format("  memory                 {:.1f} MiB in the simulator, {:.1f} MiB in all\n",
                     r["memory"]["simulator_bytes"].get<double>() / 0x1p20,
                     r["memory"]["process_peak_bytes"].get<double>() / 0x1p20);
}

std::string quality_text(const Json& r) {
  const Json& q = r["quality"];
  return fmt::format("\n  ground penetration     {:.3f} mm at most; {} bodies below the ground\n",
                     1e3 * q["ground_penetration_max"].get<double>(), q["bodies_below_ground"].get<std::uint64_t>()) +
         fmt::format("  displacement           {:.4g} m at most; the top came down {:.4g} m\n",
                     q["displacement_max"].get<double>(), q["top_drop"].get<double>()) +
         fmt::format("  deepest overlap        {:.3f} mm; {} bodies escaped\n", 1e3 * q["overlap_max"].get<double>(),
                     q["escaped"].get<std::uint64_t>()) +
         (r["joints"].get<std::uint64_t>() > 0
              ? fmt::format("  widest joint gap       {:.3f} mm\n", 1e3 * q["joint_gap_max"].get<double>())
              : std::string()) +
         fmt::format("  kinetic energy         {:.3g} J per body\n", q["kinetic_energy_per_body"].get<double>()) +
         fmt::format("  states not finite      {}\n", q["non_finite"].get<std::uint64_t>()) +
         fmt::format("  state hash             {}\n", r["state_hash"].get<std::string>());
}

}  // namespace

Json to_json(const Scene& scene, const RunResult& result) {
  const WorldDef& world = scene.world;
  Json report;
  report["environment"] = scene.name;
  report["bodies"] = dynamic_body_count(scene);
  constexpr const char* simulators[] = {"native", "device", "hybrid"};
  report["joints"] = scene.joints.size();
  report["simulator"] = simulators[static_cast<int>(world.simulator)];
  report["device"] = result.hardware.empty() ? processor_name() : result.hardware;
  report["threads"] = world.threads;
  report["dt"] = world.dt;
  report["substeps"] = world.solver.substeps;
  report["steps"] = result.step.size();
  report["step_ms"] = json_of(result.step);
  report["stages_ms"] = {{"broad_phase", json_of(result.broad_phase)},
                         {"narrow_phase", json_of(result.narrow_phase)},
                         {"collision_resolution", json_of(result.collision_resolution)}};
  report["counts"] = json_of(result.last.counts);
  report["quality"] = fathom::json_of<Json>(result.quality);
  report["state_hash"] = fmt::format("{:016x}", result.state_hash);
  report["finished"] = !result.interrupted;
  report["broad_phase"] = world.broad_phase == BroadPhase::tree ? "tree" : "sweep";
  report["solver"] = world.solver.method == Solver::soft ? "soft" : "impulse";
  report["partition"] = world.partition == Partition::colours ? "colours" : "cells";
  report["warm_start"] = world.solver.warm_start;
  report["direct_joints"] = world.solver.direct_joints;
  report["ahead"] = world.ahead;
  report["sleep"] = world.sleep.enabled;
  report["memory"] = {{"simulator_bytes", result.last.counts.memory_bytes}, {"process_peak_bytes", peak_memory()}};
  report["build"] = build_json();
  return report;
}

std::string to_text(const Json& report, const std::string& size_note) {
  return head_text(report, size_note) + timing_text(report) + counts_text(report) + quality_text(report);
}

}  // namespace fathom::cli
