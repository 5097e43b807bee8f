// A vehicle hovering above a pile of crates: an application on the engine.
//   hover [steps] [key=value …]      e.g. hover 600 simulator.mode=async loop.time=wall
#include <fmt/format.h>

#include "engine/engine.hpp"

using namespace fathom;
using namespace fathom::engine;

// Thrusters hold the vehicle at a height that actions can change.
class Vehicle final : public Entity {
 public:
  void created(Engine& engine, EntityDef& def) override {
    def.physics = BodyDef{.pose = {{0, 0, 8}, 0, {}}, .shape = box({1, 0.6f, 0.4f}), .mass = 800.0f};
    def.graphics = GraphicsBody{def.physics->shape, {0.9f, 0.7f, 0.1f, 1}, {}};
    def.tick = TickPhase::before;
    engine.input().on_action("rise", [this](bool pressed) { wanted_ += pressed ? 1.0f : 0.0f; });
  }
  void tick(const Tick&) override {
    const float error = wanted_ - pose().position.z;
    apply_force({0, 0, 800 * (9.81f + 4 * error - 4 * velocity().linear.z)});
    apply_torque(-2000.0f * velocity().angular);
  }

 private:
  float wanted_ = 6;
};

EntityDef crate(Vec3 position) {
  EntityDef def;
  def.physics = BodyDef{.pose = {position, 0, {}}, .shape = box({0.5f, 0.5f, 0.5f}), .mass = 20.0f};
  def.graphics = GraphicsBody{def.physics->shape, {}, {}};
  return def;
}

int main(int argc, char** argv) try {
  Config config;
  config.set("input.actions.rise=up");
  for (int i = 2; i < argc; ++i) config.set(argv[i]);
  Engine engine(config);

  EntityDef floor;
  floor.physics = BodyDef{.motion = MotionType::fixed, .shape = box({50, 50, 0.5f})};
  engine.world().spawn(floor);
  const EntityId vehicle = engine.world().spawn({.name = "vehicle"}, std::make_unique<Vehicle>());
  engine.timers().every(0.5, [&] { engine.world().spawn(crate({3, 0, 5})); });

  engine.run(argc > 1 ? std::stoull(argv[1]) : 600);
  fmt::print("after {:.2f} s: {} entities, the vehicle is at z = {:.3f} m\n", engine.time(), engine.world().count(),
             engine.world().find(vehicle)->pose().position.z);
} catch (const std::exception& error) {
  fmt::print(stderr, "hover: {}\n", error.what());
  return 2;
}
