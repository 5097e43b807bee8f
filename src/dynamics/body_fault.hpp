// Bodies that fail on request: tests check that no other body notices.
#pragma once

#include <atomic>
#include <cstdint>
#include <fathom/math.hpp>

namespace fathom {

/// Stages of a substep after which a body's velocity becomes NaN.
enum class SolverStage : std::uint8_t {
  before_step,  ///< the body is isolated before anything is solved
  velocities,   ///< integrated
  warm_start,
  pushes,  ///< sweeps before positions are integrated
  positions,
  relaxes,   ///< sweeps afterwards
  supports,  ///< direct solution
};
inline constexpr SolverStage last_solver_stage = SolverStage::supports;

/// Applies to all worlds of the process while armed: bodies of this category fail, unless they cannot be pushed.
struct BodyFault {
  std::atomic<bool> is_armed{false};
  std::uint64_t category = 0;
  SolverStage stage = SolverStage::velocities;
  std::uint32_t substep = 0;
  bool turns = false;  ///< its angular velocity becomes NaN instead

  bool is_due(SolverStage now, std::uint32_t in_substep) const {
    return is_armed.load(std::memory_order_relaxed) && stage == now &&
           (now == SolverStage::before_step || substep == in_substep);
  }
  void act(Vec3& linear, Vec3& angular) const { (turns ? angular : linear).y = __builtin_nanf(""); }
};

inline BodyFault body_fault;

/// Makes a body of this category fail if requested; never on a GPU.
FATHOM_HD void fail_on_request([[maybe_unused]] SolverStage now, [[maybe_unused]] std::uint32_t substep,
                               [[maybe_unused]] std::uint64_t category, [[maybe_unused]] Vec3& linear,
                               [[maybe_unused]] Vec3& angular) {
#if !defined(__CUDA_ARCH__) && !defined(FATHOM_SYCL_SOURCE)
  if (body_fault.is_due(now, substep) && category == body_fault.category) body_fault.act(linear, angular);
#endif
}

}  // namespace fathom
