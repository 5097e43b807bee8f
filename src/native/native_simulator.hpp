// The native simulator: rigid bodies on the CPU's cores and vector lanes.
#pragma once

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
  void info_changed(std::uint32_t slot) override { wake(slot); }
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

  static constexpr std::size_t contact_grain = 128;

  // The verbs of a step.
  void find_pairs();
  virtual void update_manifolds();
  /// Room for what the narrow phase finds of every contact.
  void make_room_for_changes();

  /// What one chunk of contacts met in the narrow phase.
  struct ChunkOfChanges {
    std::uint32_t recycled = 0;
    std::vector<NewManifold> begun;
    std::vector<PartedContact> parted;

    void clear() {
      recycled = 0;
      begun.clear();
      parted.clear();
    }
    void note(std::uint32_t contact, Change change) {
      recycled += change == Change::recycled;
      if (change == Change::ended || change == Change::gone) parted.push_back({contact, change == Change::gone});
    }
  };

  bool is_active(const Contact& c) const { return (state_.flags[c.a] | state_.flags[c.b]) & awake; }

  BodyState state_;
  ContactGraph graph_;
  ThreadPool pool_;
  bool lists_added_ = false;          // for those who ask for it
  std::vector<std::uint32_t> added_;  // contacts that this step's search found
  std::vector<ChunkOfChanges> chunks_of_changes_;

 private:
  void build_constraints();
  void solve();
  void finish();

  int threads_worth_while() const;
  BroadPhaseInput broad_phase_input() const;
  void prefetch_bodies(const Contact& c) const;
  void collect_changed();
  void list_active();
  void refresh_for_queries();
  void sort_active();
  void take_over_changes();
  void end_contacts();
  void begin_contacts();
  void begin_touching(const NewManifold& fresh);
  void first_manifold(NewManifold& fresh);
  void end_touching(std::uint32_t index);
  void drop_contact(std::uint32_t index, std::vector<ContactEvent>& ended);
  ContactEvent event(const Contact& c) const;
  HitEvent hit(const Contact& c) const;
  void place(std::uint32_t slot, const Pose& pose, const Velocity& velocity);
  void quarantine_failed();
  void count();
  std::size_t list_bytes() const;

  std::unique_ptr<BroadPhase> broad_phase_;
  ContactSolver solver_;
  std::optional<CellSolver> cell_solver_;  // takes its place where the partition is cells
  Islands islands_;

  std::vector<std::uint32_t> active_;      // awake bodies that can move, ascending
  std::vector<std::uint32_t> in_contact_;  // those of them that the solver moves
  std::vector<std::uint32_t> free_;        // and the others
  Neighbourhood neighbourhood_;
  bool active_is_current_ = false;
  bool in_contact_is_current_ = false;
  bool queries_are_current_ = false;
  bool set_changed_ = false;                  // bodies added or removed since the broad phase last ran
  std::vector<std::uint32_t> changed_;        // bodies with new fat boxes
  std::vector<std::uint32_t> forced_;         // bodies with a force
  std::vector<std::vector<Pair>> new_pairs_;  // per chunk of the broad phase
  std::vector<Pair> pairs_to_add_;
  std::vector<PartedContact> parted_;  // of all chunks
  std::vector<std::uint32_t> solved_before_chunk_;
  std::uint64_t contact_sorting_ = 0;  // changes with `in_contact_`

  std::vector<ContactEvent> begun_, ended_, ended_by_removal_;
  std::vector<HitEvent> hits_;
  std::vector<Quarantine> quarantined_;
};

}  // namespace fathom::native
