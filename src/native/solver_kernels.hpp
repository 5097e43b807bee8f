// The loops over blocks of contact constraints, in the widest vectors the machine has.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "dynamics/generic_joint.hpp"
#include "dynamics/softness.hpp"
#include "dynamics/solver_body.hpp"
#include "native/contact.hpp"
#include "native/joint.hpp"
#include "native/overloads.hpp"
#include "native/touch_changes.hpp"
#include "world/body_table.hpp"

namespace fathom::native {

struct SweepParameters {
  float substep = 0, inverse_substep = 0;  ///< s, 1/s
  ContactSoftness contacts;
  float push_out_velocity = 0;
  float restitution_threshold = 0;
  float friction_lead = 0;               ///< s
  bool ends_substep = false;             ///< of `iterate`: the last sweep of a substep
  bool couplings_follow = false;         ///< a sweep over couplings alone comes after this one
  std::atomic<bool>* bounced = nullptr;  ///< of `bounce`: set where something did
};

/// What `prepare` reads beside the contacts; all by slot.
struct BodiesView {
  const Pose* poses = nullptr;
  SolverBody* bodies = nullptr;
  const WorldInertia* inertias = nullptr;
  const BodyMotion* motion = nullptr;
  const float* held = nullptr;            ///< part of the supports' last solution; null where none is held
  const std::uint16_t* levels = nullptr;  ///< of bodies that are held
  const std::uint8_t* swings = nullptr;   ///< see BodyState; null where there are no joints
  const std::uint8_t* direct = nullptr;   ///< by joint, 1: its mechanism is solved directly; null where none is
  bool any_fast = true;                   ///< some body may approach another faster than a hit's threshold
  float min_deep = 1e30f;                 ///< m that a contact may keep, whatever its bodies are (dynamics/lift.hpp)
};

/// Notes contacts that carry more than sweeps can hold (`sweep_load`), as their impulses are stored.
struct LoadWatch {
  Overloads* overloads = nullptr;  ///< null: nobody watches
  const BodyTable* table = nullptr;
  const SolverBody* bodies = nullptr;
  const Velocity* before = nullptr;  ///< velocities with which the step began
  std::span<const float> heaviest;   ///< by slot (kg), of a body's structure; 0 of bodies that stand on nothing
  float least = 0;                   ///< m/s that a contact's impulse must be worth to its bodies, whatever they are
  float unit = 0;                    ///< m/s, of a contact that carries its own bodies' weight
  float stiffness = 0;               ///< 1/m, see `sweep_load`
  float dt = 0;                      ///< s

  /// A contact that gave `impulse` (N·s) along its normal over the step; `slide` is what its surfaces add to the
  /// sliding velocity (m/s).
  void look_at(std::uint32_t a, std::uint32_t b, float impulse, Vec3 slide) const;
  /// Of the same contact, at a depth (m) and with a lift (m; dynamics/lift.hpp).
  float next_lift(float lift, std::uint32_t a, std::uint32_t b, float depth, float impulse, Vec3 slide) const;

 private:
  float inverse_mass(std::uint32_t slot) const;
  float thinner_half(std::uint32_t a, std::uint32_t b) const;
  /// Whether they move against each other by more than `speed` (m/s).
  bool is_moving(std::uint32_t a, std::uint32_t b, Vec3 slide, float speed) const;
};

class ContactGraph;
/// `ContactGraph::surface_slide`.
Vec3 surface_slide(const ContactGraph& graph, std::uint32_t contact);

/// Constraints, and what outlasts a step of them.
struct Constrained {
  Contact* contacts = nullptr;
  ContactManifold* manifolds = nullptr;
  const Joint* joints = nullptr;
  JointImpulse* joint_impulses = nullptr;
  const GenericJoint* generic_joints = nullptr;  ///< by slot, as impulses; null where there are none
  GenericImpulse* generic_impulses = nullptr;
  const ContactGraph* graph = nullptr;  ///< that tells of moving surfaces
  TouchWatch touches{};
};

/// Blocks of one width. What bouncing needs is kept apart, and not at all where nothing bounces; inertia tensors and
/// rolling resistance or moving surfaces come last in a block, which ends before them where all bodies are isotropic,
/// or nothing has any.
struct BlockArray {
  std::byte* blocks = nullptr;
  float* bounces = nullptr;
  std::size_t stride = 0;     ///< bytes from block to block
  std::size_t fetch_end = 0;  ///< bodies of blocks up to there may be fetched, even beyond those that are asked for
  bool shared = false;        ///< several threads write the bodies in turn
  bool scattered = false;     ///< what constraints are made of is in other threads' caches, or in no near one
};

/// A block is `width` constraints of one colour, stored by component. Its first bytes are this header,
/// then `width` indices of A, of B and of the contact, then the floats.
struct BlockHeader {
  ConstraintKind kind = ConstraintKind::contact;  ///< of all lanes
  std::uint8_t lanes = 0;                         ///< in use
  std::uint8_t max_points = 0;                    ///< of any lane
  bool fixed_a = false;                           ///< no lane's A can be pushed
  bool still_a = false;                           ///< … nor moves by itself
  bool isotropic = false;                         ///< all bodies' inertias are multiples of the identity
  bool restitution = false;                       ///< some lane bounces
  bool held = false;                              ///< some lane is held by its supports' direct solution
  bool has_offsets = false;                       ///< some lane counts as less or more deep than it is
  bool deep = false;                              ///< some lane may be deeper than it may keep
  bool round = false;                             ///< some lane is a contact of something round
  bool rolls = false;                             ///< some lane has rolling resistance
  bool moving_surface = false;                    ///< some lane is on a surface that moves against its body
  bool ahead = false;                             ///< some lane's manifold was made where its bodies will meet
  bool moves = false;                             ///< some lane is a joint with a limit or a drive
  bool reacts = false;                            ///< … with an armature or restitution
  // Bits by lane.
  std::uint16_t in_touch = 0;  ///< touched until now
  std::uint16_t hits = 0;      ///< the last step's hit goes on
  std::uint16_t near = 0;      ///< near enough to touch as the step began
  std::uint16_t closing = 0;   ///< approached faster than a hit's threshold then
};

struct SolverKernels {
  const char* name;  ///< of the instruction set
  int width;         ///< lanes
  std::size_t block_bytes;
  std::size_t isotropic_block_bytes;  ///< of a block without inertia tensors
  std::size_t surface_block_bytes;    ///< of a block with rolling resistance or moving surfaces, and them
  std::size_t joint_block_bytes;      ///< of a block that may be of generic joints, and all of these
  std::size_t bounce_floats;          ///< a block

  /// Fills blocks [begin, end) from the constraints listed in `lanes` (width entries a block, all of one kind, `none`
  /// for empty lanes) and returns how many contact points they have. May be done again.
  std::size_t (*prepare)(BlockArray blocks, std::size_t begin, std::size_t end, const ConstraintRef* lanes,
                         const Constrained& constrained, const BodiesView& view);
  /// The sweeps over blocks of one colour.
  void (*warm_start)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies);
  /// Without warm starting: no impulses.
  void (*clear)(BlockArray blocks, std::size_t begin, std::size_t end);
  void (*solve)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies, const SweepParameters& p);
  void (*relax)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies, const SweepParameters& p);
  void (*bounce)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies, const SweepParameters& p);
  /// `impulse` solver: friction, then penetration as a velocity bias, in one sweep.
  void (*iterate)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies, const SweepParameters& p);
  /// Over couplings alone, after the same pass over everything.
  void (*solve_couplings)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies,
                          const SweepParameters& p);
  void (*relax_couplings)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies,
                          const SweepParameters& p);
  void (*iterate_couplings)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies,
                            const SweepParameters& p);
  /// Writes accumulated impulses back to the manifolds, and the offsets that a step leaves (`Slack::offset`) to
  /// the contacts; notes touches and hits. Bodies must not have been moved.
  void (*store)(BlockArray blocks, std::size_t begin, std::size_t end, const ConstraintRef* lanes,
                const Constrained& constrained, float overlap_kept, const LoadWatch& watch);
};

/// The kernels for this machine, and the same one lane wide for constraints that no colour could take.
const SolverKernels& wide_kernels();
const SolverKernels& single_kernels();

/// Names of the instruction sets this machine can run, widest first, and a way to insist on one (for tests).
/// Not thread-safe; affects worlds created afterwards. Null restores the default; returns false where unknown.
bool select_kernels(const char* name);

}  // namespace fathom::native
