#include <fmt/format.h>

#include "commands.hpp"
#include "scene/environments.hpp"

namespace fathom::cli {

int list() {
  fmt::print("Environments: unit cubes of 1 kg, friction 0.5, restitution 0\n");
  for (const Environment& environment : environments()) {
    fmt::print("  {:<9} {}\n  {:<9} size: --bodies N ({}){}\n", environment.name, environment.summary, "",
               environment.default_bodies, environment.bodies_of_layers ? " or --layers L" : "");
  }
  fmt::print(
      "\nSimulators\n"
      "  native    multi-threaded SIMD on the CPU\n"
      "\nBroad phases (--broad-phase)\n"
      "  tree      bounding volume hierarchy with margins\n"
      "  sweep     sweep-and-sort along an axis\n"
      "\nSolvers (--solver)\n"
      "  soft      substepped soft constraints with relaxation\n"
      "  impulse   sequential impulses with a velocity bias\n"
      "\nScene files (*.toml) hold scenes of your own; docs/scenes.md describes them, examples/scenes has some.\n");
  return finished;
}

}  // namespace fathom::cli
