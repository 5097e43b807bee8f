// Declarations that the C++ blocks of the documents assume (tests/snippets).
#pragma once

#include <algorithm>
#include <cstdio>
#include <fathom/compound.hpp>
#include <fathom/joint.hpp>
#include <fathom/mesh.hpp>
#include <fathom/world.hpp>
#include <vector>

#include "engine/engine.hpp"
#include "viewer/engine_window.hpp"

struct Thruster {
  void push(fathom::World& world);
};

extern fathom::World world;
extern fathom::engine::Engine engine;
extern fathom::engine::Config config;
extern fathom::engine::EntityId gate, leaf;
extern fathom::BodyId id, ground, crate, crane, hook, post, door, beam, weight, torso, arm, chassis, tyre, ship, buoy;
extern fathom::BodyId pinion, wheel, rack, load, counterweight;
extern fathom::JointId hinge;
extern fathom::JointDef def;
extern fathom::Pose on_torso, on_arm, on_chassis, on_tyre;
extern fathom::Vec3 where;
extern std::vector<fathom::Vec3> vertices;
extern std::vector<std::uint32_t> indices;
extern std::vector<float> heights;
extern std::vector<Thruster> thrusters;

void report(const fathom::Quarantine& q);
void print(float separation, float impulse);
void smoke(fathom::JointId joint, fathom::Vec3 force);
void sound(const fathom::HitEvent& hit);
void draw(std::span<const fathom::Pose> before, std::span<const fathom::Pose> after, double fraction);
