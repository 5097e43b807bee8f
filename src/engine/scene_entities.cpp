#include "engine/scene_entities.hpp"

#include <array>
#include <memory>

namespace fathom::engine {
namespace {

class KickingEntity final : public Entity {
 public:
  KickingEntity(const Scene& scene, std::vector<EntityId> bodies) : kicker_(scene), bodies_(std::move(bodies)) {}

  void tick(const Tick& tick) override {
    for (const Kicker::Kick& kick : kicker_.due(tick.step - 1))
      if (Entity* body = tick.engine.world().find(bodies_[kick.body])) body->add_velocity(kick.linear, kick.angular);
  }

 private:
  Kicker kicker_;
  std::vector<EntityId> bodies_;
};

Colour colour_of(const BodyDef& body, std::size_t index) {
  constexpr std::array palette{Colour{0.86f, 0.37f, 0.26f}, Colour{0.93f, 0.69f, 0.25f}, Colour{0.35f, 0.63f, 0.45f},
                               Colour{0.27f, 0.53f, 0.74f}, Colour{0.55f, 0.42f, 0.68f}};
  return body.motion == MotionType::fixed ? Colour{0.45f, 0.47f, 0.5f} : palette[index % palette.size()];
}

}  // namespace

void take_over_world(const Scene& scene, Config& config) {
  const auto take = [&](const char* key, auto& value, const auto& from) {
    if (config.origin(key) == "default") value = from;
  };
  auto& to = config.edit().simulator;
  const WorldDef& world = scene.world;
  take("simulator.kind", to.kind, world.simulator);
  take("simulator.device", to.device, world.device);
  take("simulator.threads", to.threads, world.threads);
  take("simulator.dt", to.dt, world.dt);
  take("simulator.substeps", to.substeps, world.solver.substeps);
  take("simulator.solver", to.solver, world.solver.method);
  take("simulator.broad_phase", to.broad_phase, world.broad_phase);
  take("simulator.partition", to.partition, world.partition);
  take("simulator.warm_start", to.warm_start, world.solver.warm_start);
  take("simulator.sleep", to.sleep, world.sleep.enabled);
  take("simulator.gravity", to.gravity, world.gravity);
}

std::vector<EntityId> spawn_scene(Engine& engine, const Scene& scene) {
  std::vector<std::string> names(scene.bodies.size());
  for (const NamedBody& named : scene.names) names[named.body] = named.name;
  std::vector<EntityId> ids;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const BodyDef& body = scene.bodies[i];
    EntityDef def;
    def.name = names[i];
    def.physics = body;
    def.graphics = GraphicsBody{body.shape, colour_of(body, i), {}};
    ids.push_back(engine.world().spawn(std::move(def)));
  }
  if (scene.kicks) {
    EntityDef def;
    def.name = "kicks";
    def.tick = TickPhase::before;
    engine.world().spawn(std::move(def), std::make_unique<KickingEntity>(scene, ids));
  }
  return ids;
}

}  // namespace fathom::engine
