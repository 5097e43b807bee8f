// Built-in scenes of any size: the four published environments, whose bodies are unit cubes of 1 kg, two of bricks, 13
// of Box3D's benchmark, chains, a landscape and four heaps of other shapes. Sleeping is off.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "scene/scene.hpp"

namespace fathom {

// Sizes below 1 throw `invalid_argument`, sizes above a world's capacity `capacity`.

/// Free bodies without ground or gravity: random poses in a cube of n·(4 m)³, kicked every 30 steps.
Scene drift(std::int64_t bodies);
/// A tower of layers of 10 × 10 bodies, 1.1 m apart, that fall on each other; the last layer may be partial.
Scene layers(std::int64_t bodies);
/// ⌊√n⌋ × ⌊√n⌋ bodies side by side on the ground, 1.1 m apart; the ground is larger from 800,000 bodies on.
Scene spread(std::int64_t bodies);
/// A pyramid of square layers, 1.05 m apart: L² bodies at the bottom, one at the top.
Scene pyramid(std::int64_t layers);

/// A round wall of n bricks of 0.5 × 0.5 × 0.25 m and 1 kg, about twenty times as long as high; two balls of 200 kg hit
/// it from opposite sides at 30 m/s after a third of a second.
Scene ring(std::int64_t bodies);
/// n such bricks in walls of 50 by 20, 4 m apart in rows 30 m apart; a ball hits the first wall of every row.
Scene walls(std::int64_t bodies);

// Scenes of Box3D's benchmark (erincatto/box3d, shared/benchmarks.c), z up, on the other scenes' ground, with its
// gravity of 10 m/s², its friction of 0.6 and, unless stated, its density of 1,000 kg/m³.

/// A flat pyramid of cubes of 100 kg, one deep, with as many full rows as the bodies allow.
Scene large_pyramid(std::int64_t bodies);
/// Flat pyramids of ten rows of such cubes, 55 each, on a square field.
Scene many_pyramids(std::int64_t bodies);
/// A pyramid of square layers of boxes of 1.95 m, dropped 0.5 m apart.
Scene wide_pyramid(std::int64_t bodies);
/// Cubes of 0.4 m in an open drum, 32 m wide with four blades, that makes a turn in 14.4 s; it grows with the cubes
/// from 8,000 on. Its parts are the first 40 bodies after the ground.
Scene washer(std::int64_t bodies);
/// Layers of 8 × 8 bodies of one hull of 32 points on a sphere of 2 m.
Scene convex_pile(std::int64_t bodies);
/// Layers of 21 × 21 rocks of 3 m that fall into a walled yard, in which a kinematic column of 16 sides orbits.
Scene junkyard(std::int64_t bodies);
/// A net of balls of 0.4 m, 1 m apart, held together and to a fixed top row by ball joints, without contacts; square if
/// the number allows.
Scene joint_grid(std::int64_t bodies);

/// Chains of 20 links of 1 kg and 25 cm with 20 kg at the end, released horizontally, 1 m apart in rows.
Scene chains(std::int64_t bodies);

/// Ragdolls of 14 capsules, cone-limited ball joints and limited hinges, that fall from 20 m, three per cell of 15 m
/// (after Box3D's `rain`); the last may lack limbs.
Scene ragdolls(std::int64_t bodies);
/// The same on a square mesh of 8 × 8 cells and a torus of 512 triangles per cell, with a rim of such cells.
Scene rain(std::int64_t bodies);

/// Trees, compounds of 22 hulls, that fall over on a wavy mesh of 150 × 200 m; its cells are 1, 0.5 or 0.25 m wide.
Scene trees100(std::int64_t bodies);
Scene trees50(std::int64_t bodies);
Scene trees25(std::int64_t bodies);
/// ⌊√n⌋ × ⌊√n⌋ fixed boxes of 10 m side by side, and 100 balls of 1 m that fall on them.
Scene large_world(std::int64_t bodies);
/// Bodies of all shapes, 0.1 to 1 m, on the side of a valley: a height field of 1,000 × 1,000 samples, 500 m wide.
Scene terrain(std::int64_t bodies);

// Heaps of about ten layers of bodies of 1,000 kg/m³ that fall into a bin.

/// Hulls of 16 points and 1 m, in eight shapes.
Scene rocks(std::int64_t bodies);
/// Spheres of 1 m.
Scene spheres(std::int64_t bodies);
/// Capsules of 1 m by 0.5 m.
Scene capsules(std::int64_t bodies);
/// Compounds of four hulls, 1 m across.
Scene tetrapods(std::int64_t bodies);
/// All shapes in equal parts from 0.1 to 1 m, friction 0.2.
Scene mixed(std::int64_t bodies);

/// Number of bodies of a flat pyramid with so many rows.
std::int64_t triangle_bodies(std::int64_t rows);
/// How many of so many bodies make whole flat pyramids: one as large as possible, or several of ten rows.
std::int64_t large_pyramid_bodies(std::int64_t bodies);
std::int64_t many_pyramids_bodies(std::int64_t bodies);

/// Number of bodies of a pyramid with so many layers, and the most layers that so many bodies allow.
std::int64_t pyramid_bodies(std::int64_t layers);
std::int64_t pyramid_layers(std::int64_t bodies);

/// An environment, found by name.
struct Environment {
  std::string_view name;
  std::string_view summary;
  std::int64_t default_bodies;
  /// Null if the size cannot be given in layers, else the number of bodies of so many.
  std::int64_t (*bodies_of_layers)(std::int64_t layers);
  /// The scene with about so many bodies.
  Scene (*make)(std::int64_t bodies);
  /// How many bodies it makes of so many, where only some numbers fit its form, else null.
  std::int64_t (*rounded)(std::int64_t bodies) = nullptr;
};

std::span<const Environment> environments();
/// The environment of that name, or null.
const Environment* find_environment(std::string_view name);

}  // namespace fathom
