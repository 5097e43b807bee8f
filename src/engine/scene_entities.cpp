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

EntityDef entity_of(const Scene& scene, std::size_t index);

/// Who comes back does so at the start of the next frame.
class StreamEntity final : public Entity {
 public:
  StreamEntity(const Scene& scene, std::vector<EntityId> bodies) : stream_(*scene.stream), bodies_(std::move(bodies)) {
    for (std::size_t i = 0; i < stream_.sources.size(); ++i) {
      definitions_.push_back(entity_of(scene, stream_.first + i));
      definitions_.back().physics->pose = stream_.sources[i];
    }
  }

  void tick(const Tick& tick) override {
    const std::optional<std::size_t> body = stream_.due(tick.step - 1);
    if (!body) return;
    EntityWorld& world = tick.engine.world();
    world.destroy(bodies_[*body]);
    bodies_[*body] = world.spawn(definitions_[*body - stream_.first]);
  }

 private:
  Stream stream_;
  std::vector<EntityId> bodies_;
  std::vector<EntityDef> definitions_;
};

/// Spawned after the bodies, so that they live when it is created.
class JointsEntity final : public Entity {
 public:
  JointsEntity(const Scene& scene, std::vector<EntityId> bodies) : joints_(scene.joints), bodies_(std::move(bodies)) {}

  void created(Engine& engine, EntityDef&) override {
    for (const SceneJoint& joint : joints_) engine.world().join(bodies_[joint.a], bodies_[joint.b], joint.def);
  }

 private:
  std::vector<SceneJoint> joints_;
  std::vector<EntityId> bodies_;
};

Colour colour_of(const BodyDef& body, std::size_t index) {
  constexpr std::array palette{Colour{0.86f, 0.37f, 0.26f}, Colour{0.93f, 0.69f, 0.25f}, Colour{0.35f, 0.63f, 0.45f},
                               Colour{0.27f, 0.53f, 0.74f}, Colour{0.55f, 0.42f, 0.68f}};
  return body.motion == MotionType::fixed ? Colour{0.45f, 0.47f, 0.5f} : palette[index % palette.size()];
}

/// Without a name.
EntityDef entity_of(const Scene& scene, std::size_t index) {
  EntityDef def;
  def.physics = scene.bodies[index];
  def.graphics = GraphicsBody{scene.bodies[index].shape, colour_of(scene.bodies[index], index), {}};
  return def;
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
    EntityDef def = entity_of(scene, i);
    def.name = names[i];
    ids.push_back(engine.world().spawn(std::move(def)));
  }
  if (!scene.joints.empty()) {
    EntityDef def;
    def.name = "joints";
    engine.world().spawn(std::move(def), std::make_unique<JointsEntity>(scene, ids));
  }
  if (scene.kicks) {
    EntityDef def;
    def.name = "kicks";
    def.tick = TickPhase::before;
    engine.world().spawn(std::move(def), std::make_unique<KickingEntity>(scene, ids));
  }
  if (scene.stream) {
    EntityDef def;
    def.name = "stream";
    def.tick = TickPhase::before;
    engine.world().spawn(std::move(def), std::make_unique<StreamEntity>(scene, ids));
  }
  return ids;
}

}  // namespace fathom::engine
