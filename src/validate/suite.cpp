#include "validate/suite.hpp"

#include <algorithm>
#include <array>
#include <chrono>

#include "validate/case_list.hpp"

namespace fathom::validate {
namespace {

constexpr auto table = std::to_array<Case>({
    {"laws", "free-fall", "A projectile follows the exact parabola to 1 mm.", free_fall},
    {"laws", "colliding-cloud",
     "Bodies collide without gravity for 1,000 steps; momentum drifts by at most 5e-4 (Newton, "
     "test_physics_verification).",
     colliding_cloud},
    {"laws", "torque-free", "A spinning box keeps its angular momentum within 5e-3 and its energy bounded (Newton).",
     torque_free},
    {"laws", "tennis-racket",
     "A box thrown about its middle axis flips with the period that elliptic functions give, within 2 %.",
     tennis_racket},
    {"friction", "ramps",
     "Boxes on ramps of 3–40° with µ 0.1–1.0 slip beyond atan µ (Newton, test_rigid_friction_ramp; here ± 1°).", ramps},
    {"friction", "stopping-distance", "A box slides to rest in v₀²/2µg within 1 %, in 12 directions (Newton).",
     stopping_distance},
    {"friction", "sliding-sphere", "A sphere that slides at 3 m/s ends rolling at 5/7 of it.", sliding_sphere},
    {"friction", "spinning-box", "A spinning box stops by friction's torque under uniform pressure, within 5 %.",
     spinning_box},
    {"restitution", "rebound",
     "Balls rebound to e²h within 2 % at Δt 1/240 s and 5 % at 1/60 s, and never above their start.", rebound},
    {"restitution", "cradle", "Rows of balls pass a hit on to the last one (Newton's cradle).", cradle},
    {"contact force", "stacked-balls",
     "Eight stacked balls press on the ground with their weight within 1e-3 (Chrono, utest_CH_compute_contact).",
     stacked_balls},
    {"contact force", "impulse-balance", "Reported impulses are the changes of momentum.", impulse_balance},
    {"SimBenchmark", "bouncing", "49 balls bounce for 20 s and keep their energy.", bouncing},
    {"SimBenchmark", "666", "216 balls fall into a heap without friction; how deep they overlap.", spheres_666},
    {"SimBenchmark", "elastic-666", "The same, elastic: how well energy is kept.", elastic_666},
    {"SimBenchmark", "rolling", "A plate with 25 balls is pushed with 150 N; velocities compared with the exact ones.",
     rolling},
    {"SimBenchmark", "kapla", "A tower of 102 blocks stands for 60,000 steps.", kapla},
    {"stability", "tall-stack", "Columns of cubes stand for 60 s.", tall_stack},
    {"stability", "mass-ratios", "Light boxes carry heavy ones.", mass_ratios},
    {"stability", "wall-pyramid", "A pyramid of 16 rows comes to rest: kinetic energy at most 1e-5 J (three-avbd).",
     wall_pyramid},
    {"stability", "sizes", "Bodies from 1 cm to 100 m stand.", sizes},
    {"stability", "time-steps", "Ten cubes stand at time steps from 1/30 to 1/1000 s.", time_steps},
    {"stability", "random-stacks",
     "Stacks of 3 to 20 boxes and cylinders with masses up to 1,000:1 in any order stand.", random_stacks},
    {"stability", "pressed-layers",
     "Slabs and balls fall on layers of bodies up to 100,000 times lighter: none is thrown.", pressed_layers},
    {"stability", "card-house", "A house of cards of three storeys stands.", card_house},
    {"stability", "arch", "An arch of fifteen stones stands without mortar.", arch},
    {"stability", "dominoes", "A row of dominoes falls to its end at an even pace.", dominoes},
    {"stability", "crossed-tower", "A tower of crossed blocks stands when blocks are taken out.", crossed_tower},
    {"stability", "spinning-top", "A fast top stays up.", spinning_top},
    {"standing", "standing-large-pyramid",
     "A flat pyramid of 100 rows of cubes stands for 60 s and moves at most 0.20 m (Box3D, large_pyramid).",
     standing_large_pyramid},
    {"standing", "standing-walls", "Walls in running bond, 20 m high and 1 and 0.5 m thick, stand for 60 s.",
     standing_walls},
    {"standing", "standing-plates", "Plates of 2 cm and crossed planks of 4 cm stay on each other for 60 s.",
     standing_plates},
    {"standing", "standing-heavy", "Light cubes carry a slab of 32 t, and cubes four times as heavy as themselves.",
     standing_heavy_on_light},
    {"standing", "standing-stones", "An arch of 31 stones and a dry-stone wall of 500 stand for 60 s.",
     standing_stones},
    {"standing", "standing-pyramids", "Pyramids of 1,240 and 9,455 cubes settle by at most 7 and 25 mm.",
     standing_pyramids},
    {"joints", "joints-pendulum", "A pendulum follows its equation of motion over ten periods and keeps its energy.",
     joint_pendulum},
    {"joints", "joints-double-pendulum", "A double pendulum let go level keeps its energy.", joint_double_pendulum},
    {"joints", "joints-heavy-chain", "A chain of 50 links hangs with a load of 1,000:1.", joint_heavy_chain},
    {"joints", "joints-net", "A net of 20 × 20 balls hangs by its top row.", joint_net},
    {"joints", "joints-momentum", "A mechanism that flies freely keeps its momentum (Newton).", joint_momentum},
    {"joints", "joints-mechanisms", "Random trees and loops fall on a floor: equal states on 1, 2 and 4 threads.",
     joint_mechanisms},
    {"joints", "joints-wedged", "A wrecking ball on a light chain swings into a wall of crates.", joint_wedged},
    {"heaps", "heaps",
     "Random heaps of all shapes, sizes, densities, floors and time steps: no body is lost, everything comes to rest.",
     heaps},
    {"heaps", "heaps-on-surfaces", "The same bodies on triangle meshes and height fields: waves and hills.",
     heaps_on_surfaces},
    {"seams", "seams", "Nothing catches on the seams of tiles, meshes and compounds; what sticks out stops.", seams},
    {"heaps", "heaps-with-joints", "The same bodies, some joined to pairs, chains and trees.", heaps_with_joints},
    {"tunnelling", "bullets", "Bullets of 1 cm at 300 m/s against plates of 1 cm.", bullets},
    {"tunnelling", "spinning-rods", "Spinning rods are thrown at a plate of 1 cm.", spinning_rods},
    {"tunnelling", "boxes-into-wall", "Boxes at 50 m/s hit a wall.", boxes_into_wall},
    {"tunnelling", "random-shots", "Bodies of all shapes and sizes at 1 to 1,000 m/s hit fixed ones.", random_shots},
    {"tunnelling", "free-shots", "Bodies of all shapes at 20 to 1,000 m/s hit some that can be pushed.", free_shots},
    {"tunnelling", "near-misses", "The same bodies pass fixed ones at a clearance, and nothing comes of it.",
     near_misses},
    {"precision", "far-from-origin", "Quality at 0, 1, 10 and 100 km.", far_from_origin},
    {"determinism", "golden-states", "The environments give the committed hashes at any number of threads.",
     golden_states},
    {"hostile input", "isolation", "A body pushed to infinity is isolated, and the others do not notice.", isolation},
    {"hostile input", "extreme-values", "Absurd velocities, masses and places stay where they are.", extreme_values},
});

}  // namespace

bool Result::passed() const {
  return std::ranges::all_of(record.checks, [](const Check& check) { return check.passed(); });
}

bool Result::as_expected() const {
  return std::ranges::all_of(record.checks, [](const Check& check) { return check.passed() || !check.known.empty(); });
}

std::span<const Case> cases() { return table; }

Result run_case(const Case& test, const Setup& setup) {
  Result result;
  result.test = &test;
  const auto start = std::chrono::steady_clock::now();
  try {
    test.run(setup, result.record);
  } catch (const Error& error) {
    result.record.at_least(std::string("ran to its end: ") + error.what(), 0, 1);
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace fathom::validate
