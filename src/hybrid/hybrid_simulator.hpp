// The hybrid simulator: collision detection on a device, solving in the native simulator.
//
// The dissertation proposes it as future work (its section 5.1). A step is the native simulator's, except that two of
// its verbs run on the device:
//
//   find_pairs        uploads changed boxes; while the device searches, the host inspects the existing contacts
//                     (which have parted, which keep their manifolds, which must be collided); pairs come back
//   update_manifolds  uploads contacts to collide in portions; each portion's manifolds come back while the next
//                     one is written, uploaded and collided; the host adopts those that are back
//
// Poses stay on the host, where the solver moves them: the device receives the pose of B in A's frame.
#pragma once

#include <memory>
#include <vector>

#include "device/detection.hpp"
#include "hybrid/device_broad_phase.hpp"
#include "native/native_simulator.hpp"

namespace fathom::hybrid {

class HybridSimulator final : public native::NativeSimulator {
 public:
  explicit HybridSimulator(const WorldDef& definition);

  std::string hardware() const override { return detection_->hardware(); }
  void step() override;
  void restore(ByteReader& in) override;
  void optimize_broad_phase() override {}
  void body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) override;
  void body_removed(std::uint32_t slot) override;

 private:
  /// Contacts of one portion of the narrow phase.
  struct Portion {
    std::size_t begin = 0, end = 0;
    std::uint32_t boxes = 0, jobs = 0;
  };
  /// Where a chunk's jobs begin in its portion: pairs of boxes, others.
  struct Offsets {
    std::uint32_t boxes = 0, others = 0;
  };

  void update_manifolds() override;
  void inspect_known();
  void inspect(std::uint32_t index);
  void submit(Portion& portion, std::uint32_t number);
  void take_over(const Portion& portion, std::uint32_t number);
  bool is_pair_of_boxes(const native::Contact& contact) const;

  std::unique_ptr<device::Detection> detection_;
  DeviceBroadPhase* device_broad_phase_;         // owned by the base class
  std::vector<native::Inspection> inspections_;  // by contact
  std::vector<std::uint32_t> job_of_;            // by contact: its index in its portion
  std::vector<Offsets> offsets_;                 // by chunk of contacts
  exec::Traffic counted_;
};

}  // namespace fathom::hybrid
