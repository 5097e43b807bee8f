// The native simulator: rigid bodies on the CPU's cores and vector lanes.
#pragma once

#include <atomic>
#include <optional>
#include <vector>

#include "native/body_state.hpp"
#include "native/broad_phase.hpp"
#include "native/cell_solver.hpp"
#include "native/contact_graph.hpp"
#include "native/islands.hpp"
#include "native/narrow_phase.hpp"
#include "native/neighbourhood.hpp"
#include "native/solver.hpp"
#include "threads/thread_choice.hpp"
#include "threads/thread_pool.hpp"
#include "world/simulator.hpp"

namespace fathom::native {

class NativeSimulator : public Simulator {
 public:
  explicit NativeSimulator(const WorldDef& definition);

  void step() override;
  void save(ByteWriter& write) const override;
  void restore(ByteReader& in) override;

  void reserve(std::uint32_t count) override { state_.reserve(count); }
  void body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) override;
  void body_removed(std::uint32_t slot) override;
  void set_pose(std::uint32_t slot, const Pose& pose) override;
  void set_velocity(std::uint32_t slot, const Velocity& velocity) override;
  void material_changed(std::uint32_t slot) override;
  void filter_changed(std::uint32_t slot) override;
  void info_changed(std::uint32_t slot) override;
  void wake(std::uint32_t slot) override;
  bool is_awake(std::uint32_t slot) const override { return state_.flags[slot] & awake; }
  void apply(std::uint32_t slot, Vec3 force, Vec3 torque) override;

  std::span<const Pose> poses() const override { return state_.poses; }
  std::span<const Velocity> velocities() const override { return state_.velocities; }
  Aabb bounds(std::uint32_t slot) const override;

  std::span<const ContactEvent> contacts_begun() const override { return begun_; }
  std::span<const ContactEvent> contacts_ended() const override { return ended_; }
  std::span<const HitEvent> hits() const override { return hits_; }
  std::span<const Quarantine> quarantined() const override { return quarantined_; }
  void for_each_contact(const std::function<void(const ContactInfo&)>& visit) const override;

  std::optional<RayHit> ray_cast(Vec3 origin, Vec3 translation, std::uint32_t mask) const override;
  void overlap(const Aabb& box, std::uint32_t mask, std::vector<std::uint32_t>& slots) const override;

 protected:
  /// One without a broad phase must be given it by `set_broad_phase` before anything else.
  NativeSimulator(const WorldDef& definition, std::unique_ptr<BroadPhase> broad_phase);
  void set_broad_phase(std::unique_ptr<BroadPhase> broad_phase) { broad_phase_ = std::move(broad_phase); }

  // The verbs of a step.
  void find_pairs();
  virtual void update_manifolds();
  /// Room for what the narrow phase finds of every contact.
  void make_room_for_changes();

  /// What one chunk of contacts met in the narrow phase.
  struct ChunkOfChanges {
    std::vector<NewManifold> begun;
    std::vector<PartedContact> parted;
  };
  /// How much of it there is: whoever takes changes over reads these and only the chunks that hold something.
  struct ChunkCounts {
    std::uint16_t recycled = 0, begun = 0, parted = 0;
  };
  void clear_chunk(std::size_t chunk) {
    chunks_of_changes_[chunk].begun.clear();
    chunks_of_changes_[chunk].parted.clear();
  }
  /// What the contacts of the chunk from `first` on have met; first manifolds are in `begun` already.
  void note(std::size_t chunk, std::uint32_t first, std::span<const Change> changes);

  bool is_active(const Contact& c) const { return (state_.flags[c.a] | state_.flags[c.b]) & awake; }

  BodyState state_;
  ContactGraph graph_;
  ThreadPool pool_;
  bool lists_added_ = false;          // for those who ask for it
  std::vector<std::uint32_t> added_;  // contacts that this step's search found
  std::vector<ChunkOfChanges> chunks_of_changes_;
  std::vector<ChunkCounts> chunk_counts_;

 private:
  void build_constraints();
  void solve();
  void finish();

  /// Moves bodies by what the solver found, or by gravity alone.
  template <bool in_contact>
  void move_part(std::span<const std::uint32_t> slots);
  /// Moves all that the solver does not, while the caller's thread begins with alone().
  template <class Alone>
  void move_free(const Alone& alone);
  void lay_out_constraints();
  int threads_worth_while();
  double waiting_in_a_heap() const;
  BroadPhaseInput broad_phase_input() const;
  void collect_changed();
  void list_active();
  void refresh_for_queries();
  void list_in_contact();
  struct Cost {
    std::uint64_t sweep = 0, contacts = 0;
  };
  void divide_if_worth_while();
  void divide();
  Cost cost_of_domains() const;
  void take_over_changes();
  void end_contacts();
  void begin_contacts();
  void begin_touching(std::uint32_t index);
  bool is_asleep(std::uint32_t slot) const;
  HitEvent first_manifold(const NewManifold& fresh);
  void end_touching(std::uint32_t index);
  void drop_contact(std::uint32_t index, std::vector<ContactEvent>& ended);
  ContactEvent event(const Contact& c) const;
  HitEvent hit(const Contact& c) const;
  void place(std::uint32_t slot, const Pose& pose, const Velocity& velocity);
  void quarantine_failed();
  void count();
  std::size_t list_bytes() const;

  ThreadChoice thread_choice_;
  std::unique_ptr<BroadPhase> broad_phase_;
  ContactSolver solver_;
  std::optional<CellSolver> cell_solver_;  // takes its place where the partition is cells
  Islands islands_;

  std::vector<std::uint32_t> active_;      // awake bodies that can move, ascending
  std::vector<std::uint32_t> in_contact_;  // those of them that the solver moves
  Neighbourhood neighbourhood_;
  std::atomic<std::size_t> failed_ = 0;  // bodies whose new state is not finite
  Cost cost_when_divided_;               // into domains
  bool active_is_current_ = false;
  bool in_contact_is_current_ = false;
  bool queries_are_current_ = false;
  bool are_free_moved_ = false;  // in this step, before `finish`
  bool set_changed_ = false;     // bodies added or removed since the broad phase last ran
  struct ChangedBodies {
    std::uint32_t count = 0;
    bool at_rest = false;
  };
  std::vector<std::uint32_t> changed_;  // bodies with new fat boxes, and room for them all
  std::size_t changed_count_ = 0;
  std::span<const std::uint32_t> changed() const { return {changed_.data(), changed_count_}; }
  std::vector<ChangedBodies> changed_in_chunk_;
  bool changed_at_rest_ = false;              // some of them are not awake
  std::vector<std::uint32_t> forced_;         // bodies with a force
  std::vector<std::vector<Pair>> new_pairs_;  // per chunk of the broad phase
  std::vector<Pair> pairs_to_add_;
  std::vector<PartedContact> parted_;  // of all chunks
  std::vector<const NewManifold*> fresh_;
  std::vector<HitEvent> meetings_;     // of `fresh_`
  std::uint64_t contact_sorting_ = 0;  // changes with `in_contact_`

  std::vector<ContactEvent> begun_, ended_, ended_by_removal_;
  std::vector<HitEvent> hits_;
  std::vector<Quarantine> quarantined_;
};

}  // namespace fathom::native
