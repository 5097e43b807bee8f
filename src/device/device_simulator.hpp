// The device simulator: the step of step.hpp behind the World's interface, on any device of the execution layer.
//
// Steps are submitted without waiting for them. The host keeps three things: the application's changes since the last
// submission (edits), the steps in flight with the edits before each, and a mirror of poses and velocities that is
// fetched on demand. A step that exceeds a capacity stops the queue; the host then makes room and resubmits the step,
// or what remains of it, and all later steps.
#pragma once

#include <algorithm>
#include <array>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "device/body_indices.hpp"
#include "device/hull_memory.hpp"
#include "device/joint_mirror.hpp"
#include "device/mirror_tree.hpp"
#include "device/query_buffers.hpp"
#include "device/query_memory.hpp"
#include "device/step.hpp"
#include "device/surface_memory.hpp"
#include "exec/device.hpp"
#include "geometry/compound_query.hpp"
#include "native/pieces.hpp"
#include "world/event_list.hpp"
#include "world/joint_trees.hpp"
#include "world/simulator.hpp"

namespace fathom::device {

template <exec::Device D>
class DeviceSimulator final : public Simulator {
 public:
  /// `device_arguments` construct the device.
  template <class... Arguments>
  explicit DeviceSimulator(const WorldDef& definition, Arguments&&... device_arguments);
  ~DeviceSimulator() override;

  std::string hardware() const override {
    const exec::DeviceInfo& info = device_.info();
    return std::string(exec::name_of(info.backend)) + ":" + std::to_string(info.index) + " " + info.name;
  }
  void step() override;
  void save(ByteWriter& write) const override;
  void restore(ByteReader& in) override;
  void synchronise() const override;

  void reserve(std::uint32_t count) override { wanted_bodies_ = std::max<std::size_t>(wanted_bodies_, count); }
  void body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) override;
  void body_removed(std::uint32_t slot) override;
  void set_pose(std::uint32_t slot, const Pose& pose) override;
  void set_velocity(std::uint32_t slot, const Velocity& velocity) override;
  void move_to(std::uint32_t slot, const Pose& pose) override;
  void add_velocity(std::uint32_t slot, const Velocity& change) override;
  void add_impulse(std::uint32_t slot, const Velocity& impulse) override;
  void material_changed(std::uint32_t slot) override { constants_changed(slot, mix_materials | wake_partners); }
  void filter_changed(std::uint32_t slot) override {
    constants_changed(slot, box_change | drop_contacts | wake_partners);
    trees_are_stale_ = true;
  }
  void info_changed(std::uint32_t slot) override { constants_changed(slot, 0); }
  void mass_changed(std::uint32_t slot) override {
    constants_changed(slot, 0);
    trees_are_stale_ = true;
  }
  void callbacks_changed() override;
  void gravity_changed() override;
  void wake(std::uint32_t slot) override;
  bool is_awake(std::uint32_t slot) const override;
  void apply(std::uint32_t slot, Vec3 force, Vec3 torque) override;

  void joint_added(std::uint32_t slot) override { note_joint(slot); }
  void joint_removed(std::uint32_t slot) override {
    joint_mirror_.note_removed(slot);
    note_joint(slot);
  }
  void joint_changed(std::uint32_t slot) override { note_joint(slot); }
  void pair_excluded(std::uint32_t a, std::uint32_t b) override { note_pair(a, b, true); }
  void pair_included(std::uint32_t a, std::uint32_t b) override { note_pair(a, b, false); }
  JointReaction joint_impulse(std::uint32_t slot) const override;

  std::span<const Pose> poses() const override;
  std::span<const Velocity> velocities() const override;
  Aabb bounds(std::uint32_t slot) const override { return tight_bounds(bodies[slot].geometry, poses()[slot]); }
  std::optional<DevicePoses> device_poses() const override { return self().publish_poses(); }
  const Profile& current_profile() const override;

  std::span<const ContactEvent> contacts_begun() const override;
  std::span<const ContactEvent> contacts_ended() const override;
  std::span<const HitEvent> hits() const override;
  std::span<const Quarantine> quarantined() const override;
  void for_each_contact(const std::function<void(const ContactInfo&)>& visit) const override;

  void visit_bodies(const MovingBox& box, BodyVisitor& visitor) const override { tree_.visit(box, visitor); }
  bool cast_rays(const ManyRays& many, const TakeHits& take) const override;
  bool cast_shapes(const ManyShapes& many, const TakeHits& take) const override;
  bool overlap_shapes(const ManyShapes& many, const TakeTouched& take) const override;

 private:
  using Event = typename D::Event;

  /// The owner of a device index: a body, or a child of its compound.
  struct PieceName {
    std::uint32_t slot = none;  ///< `none`: nobody
    std::uint32_t child = none;
  };

  struct GravityChange {
    Vec3 gravity;  ///< m/s²
    bool is_new = false;
    bool wakes = false;  ///< all bodies that it acts on
  };

  /// Trees of joints for the device, if they `are_new`.
  struct FoundMechanisms {
    bool are_new = false;
    std::vector<MechanismLink> links;
    std::vector<MechanismRecord> records;
    std::vector<std::uint32_t> levels, of_joint;
  };

  /// A step in flight, and the edits before it.
  struct PendingStep {
    std::uint64_t number = 0;
    // When the step was requested; it may be resubmitted after the application has added more.
    std::uint32_t indices = 0;
    std::size_t slots = 0;
    std::vector<Edit> edits;
    std::vector<BodyData> data;
    std::vector<JointEdit> joint_edits;
    std::vector<GenericEdit> generic_edits;
    std::vector<PairNote> pair_notes;
    std::vector<ApartEdit> apart_edits;
    FoundMechanisms mechanisms;
    GravityChange gravity;
    std::size_t uploaded = 0;  ///< number of `edits` uploaded before the step was requested
    exec::Traffic traffic;
    bool was_idle = false;     ///< the device was idle when it was submitted
    bool set_changed = false;  ///< bodies were added or removed before it
  };

  /// Buffers of each step in flight; step n uses set n modulo their number.
  struct StepBuffers {
    explicit StepBuffers(D& device)
        : start(device),
          marks(device),
          edits(device),
          data(device),
          staged_edits(device, 0),
          staged_data(device, 0),
          joint_edits(device),
          generic_edits(device),
          apart_edits(device),
          staged_joint_edits(device, 0),
          staged_generic_edits(device, 0),
          staged_apart_edits(device, 0),
          links(device),
          mechanisms(device),
          levels(device),
          of_joint(device),
          staged_links(device, 0),
          staged_mechanisms(device, 0),
          staged_levels(device, 0),
          staged_of_joint(device, 0),
          results(device),
          poses(device, 0),
          velocities(device, 0),
          flags(device, 0),
          begun(device, 0),
          ended(device, 0),
          hits(device, 0),
          copied(device) {}
    Event start;
    StageMarks<D> marks;
    std::optional<typename D::Graph> graph;
    std::optional<typename D::Graph> set_changed_graph;  ///< for the sweep, whose list is then sorted from scratch
    std::optional<typename D::Graph> repeat_graph;       ///< for a step that stopped halfway
    /// The parts of a step that asks the application; the first for `set_changed`, too.
    std::optional<typename D::Graph> pairs_graphs[2], manifolds_graph, bodies_graph;
    exec::Buffer<Edit> edits;
    exec::Buffer<BodyData> data;
    exec::PinnedBuffer<Edit> staged_edits;
    exec::PinnedBuffer<BodyData> staged_data;
    exec::Buffer<JointEdit> joint_edits;
    exec::Buffer<GenericEdit> generic_edits;
    exec::Buffer<ApartEdit> apart_edits;
    exec::PinnedBuffer<JointEdit> staged_joint_edits;
    exec::PinnedBuffer<GenericEdit> staged_generic_edits;
    exec::PinnedBuffer<ApartEdit> staged_apart_edits;
    exec::Buffer<MechanismLink> links;
    exec::Buffer<MechanismRecord> mechanisms;
    exec::Buffer<std::uint32_t> levels, of_joint;
    exec::PinnedBuffer<MechanismLink> staged_links;
    exec::PinnedBuffer<MechanismRecord> staged_mechanisms;
    exec::PinnedBuffer<std::uint32_t> staged_levels, staged_of_joint;
    SlotResults results;  ///< on the device, if every step's results are copied
    exec::PinnedBuffer<Pose> poses;
    exec::PinnedBuffer<Velocity> velocities;
    exec::PinnedBuffer<std::uint32_t> flags;
    std::size_t slots = 0;  ///< number of entries read into the last three
    exec::PinnedBuffer<PairRecord> begun, ended;
    exec::PinnedBuffer<HitRecord> hits;
    std::uint64_t events_of = 0;  ///< the step whose events the last three hold
    Event copied;                 ///< results and events have arrived
  };
  /// One more than steps in flight, because a step is timed from the end of the previous one.
  Event& end_of(std::uint64_t step) const { return *ends_[step % ends_.size()]; }
  StepBuffers& buffers_of(std::uint64_t step) const { return *step_buffers_[step % max_pending_]; }

  /// Whether every step's results go to the host, not only requested ones.
  bool copies_results() const { return def.ahead > 0 && def.copy_results; }

  /// Whether bodies may touch in several parts, which are counted as events arrive.
  bool has_parts() const { return has_compounds() || has_surfaces(); }
  bool has_compounds() const { return shapes_ & shape_bit(ShapeType::compound); }
  bool has_surfaces() const { return shapes_ & (shape_bit(ShapeType::mesh) | shape_bit(ShapeType::height_field)); }

  /// If steps run ahead of reading, each one's events must be kept.
  std::size_t event_lists() const { return def.ahead > 0 ? max_pending_ : 1; }

  // Submitting.
  void make_room();
  void upload_shapes();
  void choose_grid();
  PublishedSettings published_settings() const;
  PublishedRoom published_room() const;
  Step<D> step_of(StepBuffers& buffers);
  void record();
  void forget_graphs();
  void order_in_space();
  /// `after`: if the step has stopped, the reason; then only what remains of it is submitted.
  void submit(PendingStep& pending, bool with_edits, Stop after = no_stop);
  /// Whether the application may be asked within steps.
  bool asks() const;
  std::uint32_t question_bits(const BodyInfo& info) const;
  void submit_asking(const PendingStep& pending, Stop after);
  template <class List>
  Counters count_questions(const List& list);
  void ask_about_pairs(Step<D>& step);
  void ask_about_contacts(Step<D>& step);
  ContactAnswer answer(const ContactQuestion& question);
  void upload_refused();
  void note_kept_out(std::span<const Contact> contacts);
  std::vector<Vec3> own_slides(std::size_t contacts);
  void reserve_results(const PendingStep& pending);
  void submit_results(const PendingStep& pending);
  void reserve_events(StepBuffers& buffers, std::size_t room);
  CopyEvents copy_of_events(StepBuffers& buffers, std::uint64_t number);
  SlotResults& publish(SlotResults& results, std::uint32_t indices);
  void stage_edits(PendingStep& pending);
  template <class T>
  std::size_t stage(exec::PinnedBuffer<T>& staging, exec::Buffer<T>& buffer, const std::vector<T>& list,
                    std::size_t done);
  void upload_edits(const PendingStep& pending);
  void upload_ahead();
  void change_gravity(const PendingStep& pending);
  void add_edit(Edit edit);
  void list_last_edits();
  void constants_changed(std::uint32_t slot, std::uint32_t changes);
  void add_data_edit(EditKind kind, std::uint32_t index, const BodyData& data);
  BodyData body_data(std::uint32_t slot);
  BodyData child_data(std::uint32_t slot, std::uint32_t child);
  void note_material(const Material& material);
  BodyData surface_data(const BodyInfo& info, const Geometry& shape, const Material& material,
                        const Filter& own_filter);
  std::uint32_t children_of(std::uint32_t slot) const;
  std::uint32_t reserved_indices(std::uint32_t slot) const;
  template <class Act>
  void for_each_hull(std::uint32_t slot, const Act& act) const;
  void note_fixed(std::uint32_t slot);

  // Joints.
  void note_joint(std::uint32_t slot);
  void note_pair(std::uint32_t a, std::uint32_t b, bool apart);
  void list_joint_edits(PendingStep& pending);
  void make_room_for_joints();
  void stage_joint_edits(PendingStep& pending);
  void upload_joint_edits(const PendingStep& pending);
  void upload_apart_edits(const PendingStep& pending);

  // Mechanisms.
  bool solves_directly() const;
  void list_mechanisms(PendingStep& pending);
  void make_room_for_mechanisms();
  void stage_mechanisms(PendingStep& pending);
  void upload_mechanisms(const PendingStep& pending);

  // Finished steps.
  bool oldest_is_done() const;
  void retire_oldest();
  void retire_all() const;
  void repair(const Report& report);
  void make_room_for(const Report& report);
  /// Retires the steps that a reader must, or may, see.
  void look() const;
  void make_profile();

  // The mirror.
  void fetch_bodies() const;
  void fetch_bodies_now();
  std::size_t fetch_results(std::size_t slots);
  std::size_t mirror_room() const { return std::min({poses_.size(), velocities_.size(), flags_.size()}); }
  std::optional<DevicePoses> publish_poses();
  std::span<const Pose> refresh_queries() override;

  // Many queries at once.
  template <class Ask>
  bool answers(std::size_t count, const Ask& ask);
  QueryView upload_scene(const QuerySight& sight, std::span<const std::uint32_t> ignored);
  const Vec3* upload_corners(std::span<const ShapeCast> shapes);
  void cast_rays_now(const ManyRays& many, const TakeHits& take);
  void cast_shapes_now(const ManyShapes& many, const TakeHits& take);
  void overlap_shapes_now(const ManyShapes& many, const TakeTouched& take);
  template <class Query, class Asked, class Write, class Kernel>
  void cast_in_batches(CastBatches<D, Asked>& batches, std::span<const Query> queries, const Write& write,
                       const Kernel& kernel, const TakeHits& take);

  void mirror(const Edit& edit, const std::vector<BodyData>& data);
  void mirror_waking(std::uint32_t slot);
  void mirror_gravity();
  void fetch_events() const;
  /// Collects the events of the finished step `number`, whose report is `report`.
  void collect_events(std::uint64_t number, const Report& report);
  void merge_parts(std::vector<PairRecord>& begun, std::vector<PairRecord>& ended);
  void clear_events();
  template <class T>
  std::vector<T> download(const T* from, std::size_t count);
  /// The same, for use in every step.
  template <class T>
  std::span<const T> fetch(exec::PinnedBuffer<T>& staging, const T* from, std::size_t count);
  // Snapshots.
  template <class T>
  void upload(T* to, const std::vector<T>& from);
  bool is_on_device() const;
  template <class T, class Check>
  void read_into(ByteReader& in, T* to, std::size_t room, std::size_t count, const Check& check);
  void restore_hulls();
  void make_room_for_restored(ByteReader& in, const Counters& counters);
  std::vector<BodyConstants> restore_bodies(ByteReader& in, const Counters& counters);
  void restore_contacts(ByteReader& in, const Counters& counters, const std::vector<BodyConstants>& constants);
  void restore_layout(ByteReader& in, const Counters& counters);
  void restore_joints(ByteReader& in, const Counters& counters);
  void restore_generic_joints(ByteReader& in, std::uint32_t count);
  void restore_list(ByteReader& in, const Counters& counters);
  void publish_restored();
  std::vector<PieceName> name_pieces() const;
  void give_links(BodyConstants& constants, const PieceName& name);
  void check_indices(const ByteReader& in, const Counters& counters) const;

  // Reading fetches missing data, which changes nothing that a reader could have seen.
  DeviceSimulator& self() const { return *const_cast<DeviceSimulator*>(this); }

  D device_;
  std::size_t max_pending_;
  BodyMemory body_memory_;
  ContactMemory contact_memory_;
  JointMemory joint_memory_;
  MechanismMemory mechanism_memory_;
  SlotResults results_;
  GridMemory grid_memory_;
  PublishedMemory<D> published_memory_;
  HullMemory hull_memory_;
  SurfaceMemory surface_memory_;
  exec::Buffer<Counters> counters_;
  exec::PinnedBuffer<Report> reports_;
  std::vector<std::unique_ptr<StepBuffers>> step_buffers_;
  std::vector<std::unique_ptr<Event>> ends_;
  float grid_base_ = 0;
  std::uint32_t wanted_slots_ = first_slots;  ///< overlaps per body that the sweep has room for
  bool set_changed_ = true;                   ///< bodies were added or removed since the last submission

  std::size_t wanted_bodies_ = 0;
  std::size_t wanted_contacts_ = 0, wanted_manifolds_ = 0;
  BodyIndices indices_;
  JointMirror joint_mirror_;
  JointTrees trees_;
  bool trees_are_stale_ = true;   // joints or their bodies have changed since the trees were found
  GravityChange gravity_change_;  // since the last step

  std::vector<Edit> edits_;                // since the last submission
  std::size_t uploaded_ = 0;               // number of them already in the next step's buffers
  bool uploads_ahead_ = true;              // no edit of this batch has changed after its upload
  std::vector<BodyData> data_;             // belonging to the edits
  std::vector<std::uint32_t> last_edit_;   // by index: position in `edits_`
  std::deque<PendingStep> pending_steps_;  // submitted and not retired
  std::uint64_t submitted_ = 0;
  std::uint32_t movable_ = 0;  // number of bodies that are not fixed

  // The newest retired step, and the data read from it.
  Report newest_;
  PublishedReport newest_published_;
  double newest_interval_ = 0;
  exec::Traffic newest_traffic_;
  exec::Traffic counted_;                           // up to the last submission
  bool may_bounce_ = false;                         // some material has a restitution above zero
  bool any_extras_ = false;                         // some material has a rolling resistance or `SurfaceTraits`
  std::uint32_t fixed_slot_ = none;                 // of the last fixed body with faces
  std::uint32_t shapes_ = 0, recorded_shapes_ = 0;  // see StepSettings::shapes; the second is that of the graphs
  // Pairs of bodies that the application has refused, see `refused_key`: when they came near, or all of their contacts
  // in this step.
  std::unordered_set<std::uint64_t> kept_out_, refused_in_step_;
  std::vector<std::uint32_t> question_bits_;  // by slot, as the device has them
  bool is_asking_ = false;                    // a callback runs: the mirror holds the state of the step's beginning
  bool profile_is_current_ = false;
  bool bodies_are_current_ = false;
  bool events_are_current_ = false;
  mutable bool events_are_read_ = false;  // since the last step was requested
  mutable bool joints_are_current_ = false;
  // By slot, with spare room: the device writes them.
  exec::PinnedBuffer<Pose> poses_;
  exec::PinnedBuffer<Velocity> velocities_;
  exec::PinnedBuffer<std::uint32_t> flags_;
  MirrorTree tree_;  // for queries
  QueryMemory query_memory_;
  std::unique_ptr<QueryBuffers<D>> query_buffers_;  // made by the first call of many
  std::mutex querying_;
  bool is_querying_ = false;
  // Reading marks entries as read.
  mutable EventList<ContactEvent> begun_, ended_;
  mutable EventList<HitEvent> hits_;
  mutable EventList<Quarantine> quarantined_;
  bool told_of_dropped_events_ = false;
  std::unordered_map<std::uint64_t, std::uint32_t> touching_parts_;  // number, by the indices of two bodies
  mutable exec::PinnedBuffer<Contact> contacts_read_;
  mutable exec::PinnedBuffer<ContactManifold> manifolds_read_;
  mutable exec::PinnedBuffer<JointRecord> joints_read_;
  mutable exec::PinnedBuffer<GenericImpulse> generic_impulses_read_;
};

}  // namespace fathom::device
