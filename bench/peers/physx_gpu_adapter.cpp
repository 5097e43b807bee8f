// PhysX on a GPU: broad phase, narrow phase and solver there, results left there (its direct GPU interface).
#include <dlfcn.h>
#include <extensions/PxCudaHelpersExt.h>

#include "physx_world.hpp"

namespace fathom::peers {
namespace {

using namespace physx;
using Ext::PxCudaHelpersExt;

/// Device memory of the context.
template <class T>
class DeviceArray {
 public:
  DeviceArray(PxCudaContextManager& context, std::size_t count)
      : context_(context),
        count_(static_cast<PxU32>(count)),
        data_(PxCudaHelpersExt::allocDeviceBuffer<T>(context, count)) {}
  ~DeviceArray() { PxCudaHelpersExt::freeDeviceBuffer(context_, data_); }
  DeviceArray(const DeviceArray&) = delete;
  DeviceArray& operator=(const DeviceArray&) = delete;

  T* data() const { return data_; }
  PxU32 size() const { return count_; }
  void write(const std::vector<T>& from) {
    PxCudaHelpersExt::copyHToD(context_, data_, from.data(), static_cast<PxU32>(from.size()));
  }
  std::vector<T> read() const {
    std::vector<T> all(count_);
    PxCudaHelpersExt::copyDToH(context_, all.data(), data_, count_);
    return all;
  }

 private:
  PxCudaContextManager& context_;
  PxU32 count_;
  T* data_;
};

/// PhysX's CUDA context, one per process: starting it takes longer than most scenes run.
PxCudaContextManager& cuda_context() {
  static PxCudaContextManager* const context =
      PxCreateCudaContextManager(physx_foundation(), PxCudaContextManagerDesc());
  if (context == nullptr || !context->contextIsValid())
    throw Error(ErrorCode::unavailable, "PhysX finds no CUDA device that its PhysXGpu library can use");
  return *context;
}

PxSceneDesc description(const Scene& scene) {
  PxSceneDesc desc = PhysxWorld::description(scene);
  desc.cudaContextManager = &cuda_context();
  desc.flags |= PxSceneFlag::eENABLE_GPU_DYNAMICS | PxSceneFlag::eENABLE_DIRECT_GPU_API;
  desc.broadPhaseType = PxBroadPhaseType::eGPU;
  // Enough room that no contact is dropped: the defaults suffice for some 10,000 bodies.
  const auto count = static_cast<PxU32>(scene.bodies.size());
  PxGpuDynamicsMemoryConfig& room = desc.gpuDynamicsConfig;
  room.maxRigidContactCount = std::max(room.maxRigidContactCount, 48 * count);
  room.maxRigidPatchCount = std::max(room.maxRigidPatchCount, 12 * count);
  room.foundLostPairsCapacity = std::max(room.foundLostPairsCapacity, 32 * count);
  return desc;
}

class PhysxGpuEngine final : public Engine {
 public:
  PhysxGpuEngine(const Scene& scene, int threads) : world_(scene, threads, description(scene)) {
    for (std::size_t i = 0; i < scene.bodies.size(); ++i)
      if (scene.bodies[i].motion == MotionType::dynamic) moving_.push_back(i);
  }

  void step() override {
    write_velocities();
    world_.step();
    if (!memory_) reach_bodies();
  }

  void read(std::span<Pose> poses, std::span<Velocity> velocities) const override {
    world_.read(poses, velocities);  // of fixed bodies, and of all before the first step
    if (!memory_) return;
    const std::vector<PxTransform> transforms = read(memory_->poses, PxRigidDynamicGPUAPIReadType::eGLOBAL_POSE);
    const std::vector<PxVec3> linear = read(memory_->vectors, PxRigidDynamicGPUAPIReadType::eLINEAR_VELOCITY);
    const std::vector<PxVec3> angular = read(memory_->vectors, PxRigidDynamicGPUAPIReadType::eANGULAR_VELOCITY);
    for (std::size_t k = 0; k < moving_.size(); ++k) {
      poses[moving_[k]] = from_physx(transforms[k]);
      velocities[moving_[k]] = {from_physx(linear[k]), 0, from_physx(angular[k]), 0};
    }
  }

  void set_velocity(std::size_t body, const Velocity& v) override {
    if (!memory_) return world_.set_velocity(body, v);
    changed_.push_back(world_.actors()[body]->is<PxRigidDynamic>()->getGPUIndex());
    linear_.push_back(to_physx(v.linear));
    angular_.push_back(to_physx(v.angular));
  }

  void move(const Orbiter::Target& target) override { world_.move(target); }

  std::string trouble() const override { return world_.trouble(); }

 private:
  struct Memory {
    DeviceArray<PxRigidDynamicGPUIndex> indices, changed;
    DeviceArray<PxTransform> poses;
    DeviceArray<PxVec3> vectors;

    Memory(PxCudaContextManager& context, std::size_t count)
        : indices(context, count), changed(context, count), poses(context, count), vectors(context, count) {}
  };

  // Bodies have GPU indices after the first step.
  void reach_bodies() {
    std::vector<PxRigidDynamicGPUIndex> indices;
    for (const std::size_t i : moving_) indices.push_back(world_.actors()[i]->is<PxRigidDynamic>()->getGPUIndex());
    memory_ = std::make_unique<Memory>(cuda_context(), indices.size());
    memory_->indices.write(indices);
  }

  template <class T>
  std::vector<T> read(const DeviceArray<T>& into, PxRigidDynamicGPUAPIReadType::Enum what) const {
    const PxDirectGPUAPI& gpu = world_.scene().getDirectGPUAPI();
    if (!gpu.getRigidDynamicData(into.data(), memory_->indices.data(), what, into.size()))
      throw Error(ErrorCode::unavailable, "PhysX does not give its bodies' state: " + world_.trouble());
    return into.read();
  }

  void write_velocities() {
    if (changed_.empty()) return;
    PxDirectGPUAPI& gpu = world_.scene().getDirectGPUAPI();
    const auto count = static_cast<PxU32>(changed_.size());
    memory_->changed.write(changed_);
    memory_->vectors.write(linear_);
    gpu.setRigidDynamicData(memory_->vectors.data(), memory_->changed.data(),
                            PxRigidDynamicGPUAPIWriteType::eLINEAR_VELOCITY, count);
    memory_->vectors.write(angular_);
    gpu.setRigidDynamicData(memory_->vectors.data(), memory_->changed.data(),
                            PxRigidDynamicGPUAPIWriteType::eANGULAR_VELOCITY, count);
    changed_.clear(), linear_.clear(), angular_.clear();
  }

  mutable PhysxWorld world_;  // PhysX's reading functions are not const
  std::vector<std::size_t> moving_;
  std::unique_ptr<Memory> memory_;
  std::vector<PxRigidDynamicGPUIndex> changed_;
  std::vector<PxVec3> linear_, angular_;
};

}  // namespace

bool physx_gpu_is_there() {
  // As PhysX itself does.
  return dlopen("libcuda.so.1", RTLD_LAZY) != nullptr && dlopen("libPhysXGpu_64.so", RTLD_LAZY) != nullptr;
}

EngineKind physx_gpu_engine() {
  return {"physx-gpu", physx_version() + " GPU", true, [](const Scene& scene, int threads) -> std::unique_ptr<Engine> {
            return std::make_unique<PhysxGpuEngine>(scene, threads);
          }};
}

}  // namespace fathom::peers
