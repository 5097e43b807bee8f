#include "engine/scene_script.hpp"

#include <unordered_map>
#include <utility>

namespace fathom::engine {
namespace {

/// Which handles will have a body after a list of commands.
class Presence {
 public:
  Presence(const CommandRunner& runner, const CommandList& commands) : runner_(runner) {
    for (const Command& command : commands.commands()) {
      if (command.kind == CommandKind::add) changed_[command.body.index] = command.body.generation;
      if (command.kind == CommandKind::remove) changed_[command.body.index] = 0;
    }
  }
  bool operator()(BodyHandle body) const {
    if (body.generation == 0) return false;
    const auto found = changed_.find(body.index);
    return found == changed_.end() ? runner_.contains(body) : found->second == body.generation;
  }

 private:
  const CommandRunner& runner_;
  std::unordered_map<std::uint32_t, std::uint32_t> changed_;  // generation by index; 0: removed
};

}  // namespace

SceneScript::SceneScript(const Scene& scene, std::vector<BodyHandle> bodies)
    : kicker_(scene), stream_(scene.stream), streamed_(streamed_bodies(scene)), bodies_(std::move(bodies)) {
  if (scene.orbit) orbiter_.emplace(scene);
}

void SceneScript::before_step(std::uint64_t step, const CommandRunner& runner, CommandList& commands) {
  const std::uint64_t made = step - 1;
  const Presence present(runner, commands);
  for (const Kicker::Kick& kick : kicker_.due(made))
    if (const BodyHandle body = bodies_[kick.body]; present(body))
      commands.push({CommandKind::add_velocity, body, kick.linear, kick.angular, {}, 0});
  if (orbiter_)
    for (const Orbiter::Target& target : orbiter_->due(made))
      if (const BodyHandle body = bodies_[target.body]; present(body))
        commands.push({CommandKind::move_to, body, target.pose.position, {}, target.pose.rotation, 0});
  const std::optional<std::size_t> renewed = stream_ ? stream_->due(made) : std::nullopt;
  if (!renewed || !present(bodies_[*renewed])) return;
  commands.push({CommandKind::remove, bodies_[*renewed], {}, {}, {}, 0});
  commands.add(bodies_[*renewed], streamed_[*renewed - stream_->first]);
}

}  // namespace fathom::engine
