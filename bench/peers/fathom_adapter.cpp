// Fathom itself, through the interface every application uses.
#include "build_info.hpp"
#include "engine.hpp"

namespace fathom::peers {
namespace {

WorldDef definition(const Scene& scene, int threads) {
  WorldDef def = scene.world;
  def.threads = threads;
  def.sleep.enabled = false;
  return def;
}

class FathomEngine final : public Engine {
 public:
  FathomEngine(const Scene& scene, int threads)
      : world_(definition(scene, threads)), instance_(scene, world_), ids_(instance_.ids()) {}

  void step() override {
    world_.step();
    quarantined_ += world_.quarantined().size();
  }

  void read(std::span<Pose> poses, std::span<Velocity> velocities) const override {
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      poses[i] = world_.pose(ids_[i]);
      velocities[i] = world_.velocity(ids_[i]);
    }
  }

  void set_velocity(std::size_t body, const Velocity& v) override {
    world_.set_velocity(ids_[body], v.linear, v.angular);
  }

  std::string trouble() const override {
    return quarantined_ > 0 ? std::to_string(quarantined_) + " bodies in quarantine" : std::string();
  }

 private:
  World world_;
  SceneInstance instance_;
  const std::vector<BodyId>& ids_;
  std::size_t quarantined_ = 0;
};

}  // namespace

EngineKind fathom_engine() {
  return {"fathom", std::string(build_info::version) + " " + build_info::commit, true,
          [](const Scene& scene, int threads) -> std::unique_ptr<Engine> {
            return std::make_unique<FathomEngine>(scene, threads);
          }};
}

}  // namespace fathom::peers
