// PhysX on the CPU: both of its solvers, 4 position and 1 velocity iterations, its own dispatcher.
#include "physx_world.hpp"

namespace fathom::peers {
namespace {

physx::PxSceneDesc description(const Scene& scene, physx::PxSolverType::Enum solver) {
  physx::PxSceneDesc desc = PhysxWorld::description(scene);
  desc.solverType = solver;
  return desc;
}

class PhysxEngine final : public Engine {
 public:
  PhysxEngine(const Scene& scene, int threads, physx::PxSolverType::Enum solver)
      : world_(scene, threads, description(scene, solver)) {}

  void step() override { world_.step(); }
  void read(std::span<Pose> poses, std::span<Velocity> velocities) const override { world_.read(poses, velocities); }
  void set_velocity(std::size_t body, const Velocity& v) override { world_.set_velocity(body, v); }
  void move(const Orbiter::Target& target) override { world_.move(target); }
  std::string trouble() const override { return world_.trouble(); }

 private:
  PhysxWorld world_;
};

template <physx::PxSolverType::Enum Solver>
std::unique_ptr<Engine> create(const Scene& scene, int threads) {
  return std::make_unique<PhysxEngine>(scene, threads, Solver);
}

}  // namespace

EngineKind physx_engine() { return {"physx", physx_version() + " PGS", true, create<physx::PxSolverType::ePGS>}; }
EngineKind physx_tgs_engine() {
  return {"physx-tgs", physx_version() + " TGS", true, create<physx::PxSolverType::eTGS>};
}

}  // namespace fathom::peers
