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
      "  heap      random bodies of all shapes, sizes and densities in a bin, on a slope or on a moving floor\n"
      "  surface_heap\n"
      "            the same on a triangle mesh or a height field: waves and hills\n"
      "  joint_heap\n"
      "            the heap of the seed with some bodies joined to pairs, chains and trees\n"
      "            which one: --seed K (1); it decides the bodies, the time step, the substeps and sleeping\n");
  fmt::print(
      "\nSimulators\n"
      "  native    multi-threaded SIMD on the CPU\n"
      "  device    a GPU, or the host running its kernels (--device)\n"
      "  hybrid    collision detection on the device, resolution on the CPU\n"
      "\nSets of algorithms (--preset)\n"
      "  fathom    the defaults: tree, colours, soft\n"
      "  dissertation\n"
      "            those of Pereira's dissertation of 2020: sweep, cells, impulse, on a device without warm starting\n"
      "\nBroad phases (--broad-phase)\n"
      "  tree      bounding volume hierarchy with margins\n"
      "  sweep     sweep-and-sort along an axis\n"
      "\nPartitions (--partition)\n"
      "  colours   a persistent colouring of the contact graph\n"
      "  cells     cells of a uniform grid, batches inside a cell\n"
      "\nSolvers (--solver)\n"
      "  soft      substepped soft constraints with relaxation\n"
      "  impulse   sequential impulses with a velocity bias\n"
      "\nScene files (*.toml) hold scenes of your own; docs/scenes.md describes them, examples/scenes has some.\n");
  return finished;
}

}  // namespace fathom::cli
