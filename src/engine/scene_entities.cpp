#include "engine/scene_entities.hpp"

#include <array>
#include <memory>

#include "engine/scene_script.hpp"

namespace fathom::engine {
namespace {

/// Spawned after the bodies, so they exist when it is created. Joins them, and forwards the scene's actions over time.
class SceneEntity final : public Entity {
 public:
  SceneEntity(const Scene& scene, std::vector<EntityId> bodies) : scene_(scene), bodies_(std::move(bodies)) {}

  void created(Engine& engine, EntityDef&) override {
    for (const SceneJoint& joint : scene_.joints) engine.world().join(bodies_[joint.a], bodies_[joint.b], joint.def);
    for (const auto& [a, b] : scene_.excluded) engine.world().exclude(bodies_[a], bodies_[b]);
    if (!SceneScript::is_needed(scene_)) return;
    std::vector<BodyHandle> handles;
    for (const EntityId id : bodies_) {
      const Entity* const entity = engine.world().find(id);
      handles.push_back(entity ? entity->body() : BodyHandle{});
    }
    engine.simulation().add_script(std::make_unique<SceneScript>(scene_, std::move(handles)));
  }

 private:
  Scene scene_;
  std::vector<EntityId> bodies_;
};

Colour colour_of(const BodyDef& body, std::size_t index) {
  constexpr std::array palette{Colour{0.86f, 0.37f, 0.26f}, Colour{0.93f, 0.69f, 0.25f}, Colour{0.35f, 0.63f, 0.45f},
                               Colour{0.27f, 0.53f, 0.74f}, Colour{0.55f, 0.42f, 0.68f}};
  return body.motion == MotionType::fixed ? Colour{0.45f, 0.47f, 0.5f} : palette[index % palette.size()];
}

/// An entity without a name.
EntityDef entity_of(const Scene& scene, std::size_t index) {
  EntityDef def;
  def.physics = scene.bodies[index];
  def.graphics = GraphicsBody{scene.bodies[index].shape, colour_of(scene.bodies[index], index), {}};
  return def;
}

}  // namespace

void take_over_world(const Scene& scene, Config& config) {
  config.set_base({scene.world, scene.name, scene.preset, scene.said});
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
  if (!scene.joints.empty() || !scene.excluded.empty() || SceneScript::is_needed(scene)) {
    EntityDef def;
    def.name = "scene";
    engine.world().spawn(std::move(def), std::make_unique<SceneEntity>(scene, ids));
  }
  return ids;
}

}  // namespace fathom::engine
