// Fathom itself, through its public interface: on the CPU, and on the first GPU with results left there.
#include <algorithm>

#include "build_info.hpp"
#include "engine.hpp"
#include "exec/devices.hpp"

namespace fathom::peers {
namespace {

WorldDef definition(const Scene& scene, int threads, SimulatorKind simulator) {
  WorldDef def = scene.world;
  def.simulator = simulator;
  def.threads = threads;
  def.sleep.enabled = false;
  return def;
}

class FathomEngine final : public Engine {
 public:
  FathomEngine(const Scene& scene, int threads, SimulatorKind simulator)
      : world_(definition(scene, threads, simulator)), instance_(scene, world_), ids_(instance_.ids()) {}

  void step() override {
    world_.step();
    world_.wait();
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

  void move(const Orbiter::Target& target) override { world_.move_to(ids_[target.body], target.pose); }

  std::string trouble() const override {
    return quarantined_ > 0 ? std::to_string(quarantined_) + " bodies in quarantine" : std::string();
  }

 private:
  World world_;
  SceneInstance instance_;
  const std::vector<BodyId>& ids_;
  std::size_t quarantined_ = 0;
};

template <SimulatorKind Simulator>
std::unique_ptr<Engine> create(const Scene& scene, int threads) {
  return std::make_unique<FathomEngine>(scene, threads, Simulator);
}

std::string version() { return std::string(build_info::version) + " " + build_info::commit; }

}  // namespace

EngineKind fathom_engine() { return {"fathom", version(), true, create<SimulatorKind::native>}; }
EngineKind fathom_gpu_engine() { return {"fathom-gpu", version(), false, create<SimulatorKind::device>}; }

bool fathom_gpu_is_there() {
  const std::vector<exec::DeviceInfo> devices = exec::list_devices();
  return std::any_of(devices.begin(), devices.end(), [](const auto& d) { return d.available && d.is_gpu; });
}

}  // namespace fathom::peers
