// How a changing time step affects stacks: the dissertation's first suspect for its instabilities (section 4.3).
//
//     time_step_bench [--seconds S] scene:size …
//
// Scenes (pyramids by layers) run on the device simulator's host back end, with five sets of algorithms and four
// sequences of time steps. A world has a single Δt: before each step whose Δt differs from the last, the simulator is
// saved, and restored with the new one, including contacts and their impulses. "Worst" is over all steps after the
// first second.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "scene/environments.hpp"
#include "scene/quality.hpp"
#include "scene/random.hpp"
#include "world/archive.hpp"
#include "world/simulator.hpp"

namespace fathom {
namespace {

struct Algorithms {
  const char* name;
  void (*choose)(WorldDef&);
};

void impulse_with_colours(WorldDef& def, bool warm) {
  def.solver.method = Solver::impulse;
  def.solver.push_out_velocity = def.solver.max_linear_speed;  // as published
  def.solver.warm_start = warm;
}

const std::vector<Algorithms> algorithms = {
    {"fathom", [](WorldDef&) {}},
    {"impulse, colours, warm", [](WorldDef& def) { impulse_with_colours(def, true); }},
    {"impulse, colours, cold", [](WorldDef& def) { impulse_with_colours(def, false); }},
    {"dissertation, warm", [](WorldDef& def) { apply(Preset::dissertation, def), def.solver.warm_start = true; }},
    {"dissertation", [](WorldDef& def) { apply(Preset::dissertation, def); }},
};

struct Sequence {
  const char* name;
  std::function<float(std::uint64_t step, Random& random)> dt;  ///< s
};

const std::vector<Sequence> sequences = {
    {"1/60 s", [](std::uint64_t, Random&) { return 1.0f / 60; }},
    {"1/120, 1/40, 1/120…", [](std::uint64_t step, Random&) { return step % 2 == 0 ? 1.0f / 120 : 1.0f / 40; }},
    {"1/120 to 1/40, random",
     [](std::uint64_t, Random& random) { return 1.0f / 60 + static_cast<float>(random.symmetric(1.0 / 120)); }},
    {"1/60, every 60th 0.2 s", [](std::uint64_t step, Random&) { return step % 60 == 59 ? 0.2f : 1.0f / 60; }},
};

/// The same world with another Δt.
std::unique_ptr<Simulator> with_dt(std::unique_ptr<Simulator> old, float dt) {
  if (dt == old->def.dt) return old;
  std::vector<std::byte> bytes;
  ByteWriter write(bytes);
  old->bodies.save(write);
  old->save(write);
  WorldDef def = old->def;
  def.dt = dt;
  std::unique_ptr<Simulator> fresh = make_simulator(def);
  fresh->steps = fresh->profile.step = old->steps;
  ByteReader in(bytes, "world");
  fresh->bodies.restore(in);
  fresh->restore(in);
  return fresh;
}

std::unique_ptr<Simulator> simulator_of(const Scene& scene) {
  std::unique_ptr<Simulator> simulator = make_simulator(scene.world);
  for (const BodyDef& body : scene.bodies) {
    const BodyId id = simulator->bodies.add(body);
    simulator->body_added(id.index, body.pose, body.velocity);
  }
  return simulator;
}

void run(Scene scene, const std::string& name, const Algorithms& chosen, const Sequence& sequence, double seconds) {
  scene.world.simulator = SimulatorKind::device;
  scene.world.device = "host";
  scene.world.threads = 1;
  scene.world.sleep.enabled = false;
  chosen.choose(scene.world);
  scene.world.ahead = 0;
  std::unique_ptr<Simulator> simulator = simulator_of(scene);
  Random random(1);
  Quality quality;
  double time = 0, worst_penetration = 0, worst_energy = 0, unbatched = 0;
  std::uint64_t step = 0;
  for (; time < seconds; ++step) {
    simulator = with_dt(std::move(simulator), sequence.dt(step, random));
    simulator->step();
    time += static_cast<double>(simulator->def.dt);
    unbatched += simulator->current_profile().counts.unbatched;
    quality = measure_quality(scene, simulator->poses(), simulator->velocities());
    if (time < 1) continue;
    worst_penetration = std::max(worst_penetration, quality.ground_penetration_max);
    worst_energy = std::max(worst_energy, quality.kinetic_energy_per_body);
  }
  std::printf("%-11s %-23s %-23s %6llu %10.5f %10.3f %10.3f %10.2g %9.1f %6llu\n", name.c_str(), chosen.name,
              sequence.name, static_cast<unsigned long long>(step), quality.displacement_max,
              1e3 * quality.ground_penetration_max, 1e3 * worst_penetration, worst_energy,
              unbatched / static_cast<double>(step), static_cast<unsigned long long>(quality.bodies_below_ground));
  std::fflush(stdout);
}

Scene scene_of(const std::string& text) {
  const std::size_t colon = text.find(':');
  const Environment* environment = find_environment(text.substr(0, colon));
  const std::int64_t size = colon == std::string::npos ? 0 : std::atoll(text.c_str() + colon + 1);
  if (!environment || size < 1) throw Error(ErrorCode::invalid_argument, "'" + text + "' is not a scene:size");
  return environment->name == "pyramid" ? pyramid(size) : environment->make(size);
}

}  // namespace
}  // namespace fathom

int main(int argc, char** argv) try {
  using namespace fathom;
  double seconds = 30;
  std::vector<std::string> names;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word != "--seconds")
      names.push_back(word);
    else if (i + 1 == argc || (seconds = std::atof(argv[++i])) <= 0)
      throw Error(ErrorCode::invalid_argument, "--seconds needs a number above 0");
  }
  if (names.empty()) names = {"pyramid:5", "pyramid:10", "spread:100", "layers:1000"};
  std::printf(
      "scene       algorithms              time steps              steps    moved m   sunk mm   worst mm  worst J  "
      "left out  below\n");
  for (const std::string& name : names) {
    const Scene scene = scene_of(name);
    for (const Algorithms& chosen : algorithms)
      for (const Sequence& sequence : sequences) run(scene, name, chosen, sequence, seconds);
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "time_step_bench: %s\n", error.what());
  return 2;
}
