// The step of the device simulator: the order in which kernels are submitted, defined only here.
#pragma once

#include <algorithm>
#include <optional>

#include "device/ask.hpp"
#include "device/build_constraints.hpp"
#include "device/device_memory.hpp"
#include "device/fast_pairs.hpp"
#include "device/find_pairs.hpp"
#include "device/find_supports.hpp"
#include "device/finish.hpp"
#include "device/joints.hpp"
#include "device/mechanisms.hpp"
#include "device/pieces.hpp"
#include "device/prepare_constraints.hpp"
#include "device/published/published_step.hpp"
#include "device/sleep.hpp"
#include "device/solve_directly.hpp"
#include "device/store_impulses.hpp"
#include "device/surfaces.hpp"
#include "device/update_manifolds.hpp"
#include "exec/device.hpp"

namespace fathom::device {

/// Set by the host before a step is recorded.
struct StepSettings {
  float dt = 0;                     ///< s
  float grid_base = 1;              ///< m
  float restitution_threshold = 0;  ///< m/s
  float sag = 0;                    ///< s²: `contact_sag`
  SolveParameters solve;
  MoveParameters move;
  float sleep_time = 0;      ///< s
  bool bounces = false;      ///< some material has a restitution above zero
  std::uint32_t shapes = 0;  ///< `shape_bit` of every shape used so far, and further bits: others need no kernels
  PublishedSettings published;
};

/// Timestamps of a step on the device's clock.
template <exec::Device D>
struct StageMarks {
  using Event = typename D::Event;
  explicit StageMarks(D& device)
      : begin(device), pairs(device), manifolds(device), built(device), solved(device), end(device) {}
  Event begin, pairs, manifolds, built, solved, end;
};

template <exec::Device D>
class Step {
 public:
  Step(D& device, BodyMemory& bodies, ContactMemory& contacts, JointMemory& joints, MechanismMemory& mechanisms,
       GridMemory& grid, PublishedMemory<D>& published, Counters* counters, Report* reports, std::uint32_t report_count,
       const StepSettings& settings, StageMarks<D>* marks)
      : device_(device),
        bodies_(bodies.arrays()),
        contacts_(contacts.contacts()),
        surface_work_(contacts.surface_work()),
        constraints_(contacts.constraints()),
        joints_(joints.arrays()),
        mechanisms_(mechanisms.arrays()),
        grid_(grid.grid(settings.grid_base)),
        grid_entries_(grid.entries()),
        counters_(counters),
        reports_(reports),
        report_count_(report_count),
        body_capacity_(static_cast<std::uint32_t>(bodies.capacity())),
        settings_(settings),
        published_(device, published, settings.published, bodies_, contacts_, constraints_, counters, body_capacity_),
        marks_(marks) {}

  /// `set_changed`: bodies were added or removed since the last step.
  void submit(bool set_changed) {
    submit_pairs(set_changed);
    submit_manifolds();
    submit_bodies();
  }

  // The same in three parts, between which the application may be asked (ask.hpp).

  void submit_pairs(bool set_changed) {
    mark(&StageMarks<D>::begin);
    find_pairs(set_changed);
    mark(&StageMarks<D>::pairs);
  }
  void submit_manifolds() { update_manifolds(); }
  void submit_bodies() {
    mark(&StageMarks<D>::manifolds);
    build_constraints();
    solve_and_finish();
  }

  /// The manifolds that a step lacks which stopped for lack of room.
  void submit_deferred_manifolds() {
    device_.parallel_for(1, ResumeStep{counters_, SortOutContacts::group_size});
    for (const ShapePair pairs : {boxes, hulls, others, surfaces})
      device_.parallel_for(to_collide(pairs), ListDeferred{contacts_, pairs});
    collide();
  }

  /// What remains of a step that stopped because a body failed, with that body isolated.
  void submit_again() {
    device_.parallel_for(1, RepeatStep{counters_, SortOutContacts::group_size});
    if (settings_.published.cells) published_.measure_world();
    mark(&StageMarks<D>::manifolds);
    lay_out_constraints();
    solve_and_finish();
  }

  // What the application is asked, and its answers.

  void list_filtered_pairs(FilterQuestion* questions) {
    device_.parallel_for({&counters_->live_contacts, contacts_.capacity},
                         ListFilteredPairs{bodies_, contacts_, questions, counters_});
  }
  void refuse_pairs(const std::uint32_t* refused, std::uint32_t count) {
    device_.parallel_for(count, RefusePairs{contacts_, refused});
  }
  void list_contacts_that_ask(ContactQuestion* questions) {
    device_.parallel_for({&counters_->live_contacts, contacts_.capacity},
                         ListContactsThatAsk{bodies_, contacts_, questions, counters_});
  }
  void apply_answers(const ContactAnswer* answers, std::uint32_t count) {
    device_.parallel_for(count, ApplyAnswers{contact_changes(), answers});
  }

 private:
  void solve_and_finish() {
    mark(&StageMarks<D>::built);
    solve();
    mark(&StageMarks<D>::solved);
    finish();
    mark(&StageMarks<D>::end);
  }

  void find_pairs(bool set_changed) {
    if (has(ShapeType::compound))
      device_.parallel_for(body_capacity_, PlaceChildren{bodies_, grid_, counters_, settings_.dt});
    device_.parallel_for(1, BeginStep{counters_, grid_entries_});
    if (settings_.published.sweep)
      published_.find_pairs(set_changed);
    else
      search_grid();
    if (settings_.published.cells) published_.measure_world();
    device_.parallel_for(1, AllotPairs{counters_, contacts_.capacity, SortOutContacts::group_size});
    device_.parallel_for({&counters_->added, contacts_.capacity}, AddContacts{bodies_, contacts_, counters_});
  }

  void search_grid() {
    device_.parallel_for({&counters_->grid_cells, grid_entries_ / 4}, ClearGrid{grid_});
    device_.parallel_for({&counters_->grid_bodies, body_capacity_}, FillGrid{bodies_, grid_, counters_});
    const std::uint32_t groups = (body_capacity_ + search_group_bodies - 1) / search_group_bodies;
    device_.parallel_groups({&counters_->search_groups, groups},
                            SearchGrid<false>{bodies_, contacts_, grid_, counters_});
    device_.parallel_groups({&counters_->coarse_groups, groups},
                            SearchGrid<true>{bodies_, contacts_, grid_, counters_});
  }

  void update_manifolds() {
    device_.parallel_groups(contact_groups(), SortOutContacts{contact_changes()});
    if (settings_.shapes & seams_bit) {
      device_.parallel_for(live_bodies(), ClearFixedContacts{bodies_});
      device_.parallel_for({&counters_->live_contacts, contacts_.capacity}, ChainFixedContacts{bodies_, contacts_});
    }
    collide();
  }

  void collide() {
    const ContactChanges changes = contact_changes();
    device_.parallel_for(to_collide(boxes), CollideShapes<boxes>{changes, settings_.dt});
    if (has_round_shapes()) device_.parallel_for(to_collide(others), CollideShapes<others>{changes, settings_.dt});
    if (has_hulls()) device_.parallel_for(to_collide(hulls), CollideShapes<hulls>{changes, settings_.dt});
    device_.parallel_for(fast(false), LookAheadPairs<false>{changes, settings_.dt});
    if (has_hulls()) device_.parallel_for(fast(true), LookAheadPairs<true>{changes, settings_.dt});
    if (surface_work_.team_count > 0) collide_surfaces(device_, changes, surface_work_, settings_.dt);
  }

  void build_constraints() {
    if (settings_.move.sleeping) {
      if (has_joints()) device_.parallel_for(joints_.capacity, WakeJoined{bodies_, joints_, counters_});
      device_.parallel_for({&counters_->waking, body_capacity_}, WakeIslands{bodies_, counters_});
    }
    if (!settings_.published.cells) choose_colours();
    lay_out_constraints();
  }

  void lay_out_constraints() {
    const exec::Range groups{&counters_->layout_groups, contact_groups().capacity};
    const ContactsToLayOut contacts{bodies_, contacts_};
    const JointsToLayOut joints{bodies_, joints_};
    device_.parallel_groups(contact_groups(), CountColours<ContactsToLayOut>{contacts, counters_});
    if (has_joints()) device_.parallel_groups(joint_groups(), CountColours<JointsToLayOut>{joints, counters_});
    device_.parallel_groups(1, ScheduleColours{counters_});
    device_.parallel_groups(groups, LayOutConstraints<ContactsToLayOut>{contacts, constraints_, counters_});
    if (has_joints())
      device_.parallel_groups(joint_groups(), LayOutConstraints<JointsToLayOut>{joints, constraints_, counters_});
    if (settings_.published.cells) published_.partition(constraints());
    if (has_mechanisms())
      device_.parallel_phases(ListLinkContacts::max_phases, std::max(constraints_.capacity, mechanisms_.capacity),
                              ListLinkContacts{bodies_, contacts_, constraints_, mechanisms_, counters_, settings_.dt});
    if (has_mechanisms()) device_.parallel_for(links(), CheckLinks{bodies_, joints_, mechanisms_, counters_});
    device_.parallel_for(live_bodies(), LoadBodies{bodies_, counters_, settings_.solve.h, settings_.dt});
    if (has_mechanisms()) device_.parallel_for(links(), PrepareMechanisms{bodies_, joints_, mechanisms_, counters_});
    device_.parallel_groups(
        {&counters_->constraint_groups, (constraints_.capacity + constraint_group_size - 1) / constraint_group_size},
        PrepareConstraints{bodies_, contacts_, joints_, mechanisms_, constraints_, counters_,
                           settings_.restitution_threshold, 0.5f * settings_.dt,
                           static_cast<float>(settings_.solve.substeps)});
    if (has_supports())
      device_.parallel_phases(
          FindSupports::max_phases, std::max({body_capacity_, constraints_.capacity, level_slots}),
          FindSupports{bodies_, contacts_, constraints_, counters_, settings_.solve.h, settings_.dt});
  }

  void choose_colours() {
    const RecolourContacts recolour{bodies_, contacts_, constraints_, counters_};
    device_.parallel_phases(
        ChooseColours::max_phases, std::max(body_capacity_, contacts_.manifold_capacity),
        ChooseColours{recolour, ColourContacts{bodies_, contacts_, counters_}, !settings_.move.sleeping});
  }

  void solve() {
    if (joints_.generic)
      solve_with<JointKinds::all>();
    else if (has_joints())
      solve_with<JointKinds::balls>();
    else
      solve_with<JointKinds::absent>();
  }

  template <JointKinds kinds>
  void solve_with() {
    const SolveParameters& p = settings_.solve;
    const std::uint32_t sweeps = p.sweeps_before + p.sweeps_after + (settings_.bounces ? max_bounce_sweeps : 0);
    const SolveConstraints<kinds> solver{bodies_,         constraints_,    counters_,        body_capacity_,
                                         settings_.solve, joints_.generic, joints_.reactions};
    if (settings_.published.cells) {
      if constexpr (kinds == JointKinds::absent) published_.solve(solver, settings_.bounces, constraints());
    } else {
      using Directly = SolveDirectly<kinds>;
      // Two more phases for the overflow.
      const std::uint32_t max_phases = (schedule_size + 2) * (1 + p.substeps * sweeps) + 3 * p.substeps;
      // Each body occurs at most once in a colour, so a colour has no more constraints than there are bodies. Only the
      // overflow may have more.
      device_.parallel_phases(max_phases, body_capacity_, solver);
      device_.parallel_phases(max_phases + Directly::support_phases(p, max_levels) + Directly::mechanism_phases(p),
                              std::max(body_capacity_, team::size * mechanisms_.capacity),
                              Directly{solver.with_splitting(), joints_, mechanisms_});
    }
    device_.parallel_for(constraints(),
                         StoreImpulses{bodies_,
                                       contacts_,
                                       joints_,
                                       constraints_,
                                       counters_,
                                       settings_.restitution_threshold,
                                       settings_.dt,
                                       overlap_kept(settings_.dt),
                                       settings_.solve.soft && !settings_.published.cells,
                                       {bodies_, constraints_, mechanisms_, counters_, p.stiffness, settings_.dt}});
    if (has_mechanisms()) {
      device_.parallel_for(links(), StoreMechanisms{bodies_, joints_, mechanisms_, counters_});
      device_.parallel_for({&counters_->mechanisms, mechanisms_.capacity}, ClearMechanisms{mechanisms_});
    }
  }

  void finish() {
    const MoveBodies move{bodies_, grid_, counters_, settings_.move};
    device_.parallel_for(live_bodies(), move);
    hold_back_fast(move, false);
    if (has_bullets()) hold_back_fast(move, true);
    if (settings_.move.sleeping) {
      device_.parallel_for(live_bodies(), BeginIslands{bodies_});
      const IslandLink link{bodies_, settings_.sleep_time};
      device_.parallel_for({&counters_->live_contacts, contacts_.capacity}, JoinIslands{link, contacts_});
      if (has_joints()) device_.parallel_for(joints_.capacity, JoinIslandsByJoints{link, joints_, counters_});
      device_.parallel_for(live_bodies(), MeasureIslands{bodies_, counters_, settings_.sleep_time,
                                                         still_share * settings_.move.slow_below});
      device_.parallel_for(live_bodies(), FallAsleep{bodies_, counters_, settings_.sleep_time});
    }
    if (settings_.published.sweep || settings_.published.cells) published_.report();
    device_.parallel_for(1, EndStep{counters_, reports_, report_count_});
  }

  bool has_supports() const { return settings_.solve.stiffness > 0; }
  bool has_hulls() const { return has(ShapeType::hull); }
  bool has_round_shapes() const { return has(ShapeType::sphere) || has(ShapeType::capsule); }
  bool has(ShapeType type) const { return settings_.shapes & shape_bit(type); }
  bool has_joints() const { return joints_.capacity > 0; }
  bool has_mechanisms() const { return mechanisms_.capacity > 0; }
  exec::Range links() const { return {&counters_->mechanism_links, mechanisms_.link_capacity}; }
  void hold_back_fast(const MoveBodies& move, bool from_free) {
    const bool is_last = from_free == has_bullets();
    const exec::Range bodies{&counters_->fast_bodies, body_capacity_};
    const bool has_grid = !settings_.published.sweep;
    if (has_hulls())
      device_.parallel_for(bodies, HoldBackFast<true>{move, contacts_, joints_.apart, has_grid, from_free, is_last});
    else
      device_.parallel_for(bodies, HoldBackFast<false>{move, contacts_, joints_.apart, has_grid, from_free, is_last});
  }
  bool has_bullets() const { return settings_.shapes & bullets_bit; }
  ContactChanges contact_changes() const { return {bodies_, contacts_, joints_.apart, counters_, settings_.sag}; }
  exec::Range to_collide(ShapePair pairs) const { return {&counters_->to_collide[pairs], contacts_.capacity}; }
  exec::Range fast(bool with_hull) const { return {&counters_->fast[with_hull], contacts_.capacity}; }
  exec::Range live_bodies() const { return {&counters_->live_bodies, body_capacity_}; }
  exec::Range constraints() const { return {&counters_->constraints, constraints_.capacity}; }
  std::uint32_t joint_groups() const {
    constexpr std::uint32_t size = CountColours<JointsToLayOut>::group_size;
    return (joints_.capacity + size - 1) / size;
  }
  exec::Range contact_groups() const {
    return {&counters_->contact_groups,
            (contacts_.capacity + SortOutContacts::group_size - 1) / SortOutContacts::group_size};
  }
  void mark(typename D::Event StageMarks<D>::*moment) {
    if (marks_) device_.mark(marks_->*moment);
  }

  D& device_;
  BodyArrays bodies_;
  ContactArrays contacts_;
  SurfaceWork surface_work_;
  ConstraintArrays constraints_;
  JointArrays joints_;
  MechanismArrays mechanisms_;
  Grid grid_;
  std::uint32_t grid_entries_;
  Counters* counters_;
  Report* reports_;
  std::uint32_t report_count_;
  std::uint32_t body_capacity_;
  StepSettings settings_;
  PublishedStep<D> published_;
  StageMarks<D>* marks_;
};

}  // namespace fathom::device
