// Loops over blocks of contact constraints, in the widest vectors of the machine.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "dynamics/friction_by_direction.hpp"
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
  bool ends_substep = false;             ///< for `iterate`: the last sweep of a substep
  bool couplings_follow = false;         ///< a sweep over couplings alone follows
  std::atomic<bool>* bounced = nullptr;  ///< for `bounce`: set if any contact did
};

class LinkContacts;

/// What `prepare` reads besides the contacts; all by slot.
struct BodiesView {
  const Pose* poses = nullptr;
  SolverBody* bodies = nullptr;
  const WorldInertia* inertias = nullptr;
  const BodyMotion* motion = nullptr;
  const float* held = nullptr;                  ///< part of the supports' last solution; null if none is held
  const std::uint16_t* levels = nullptr;        ///< of held bodies
  const Overloads* overloads = nullptr;         ///< null if none has added inertia
  const std::uint8_t* flags = nullptr;          ///< see BodyState
  const WorldDef* def = nullptr;                ///< read where contacts may differ
  const std::uint8_t* swings = nullptr;         ///< see BodyState; null without joints
  const LinkContacts* link_contacts = nullptr;  ///< read where there are joints
  const std::uint8_t* direct = nullptr;         ///< by joint, 1: its mechanism is solved directly; null if none is
  bool any_fast = true;                         ///< some body may approach another faster than the hit threshold
  float half_step = 0;                          ///< s, half a step
  float substeps = 1;                           ///< in a step
  float min_deep = 1e30f;  ///< m that a contact may keep, whatever its bodies are (dynamics/lift.hpp)

  /// Whether some contact may have its own softness (`ContactHold`).
  bool may_differ() const { return held || overloads || swings; }
};

/// Notes contacts that carry more than sweeps can hold (`sweep_load`), as their impulses are stored.
struct LoadWatch {
  Overloads* overloads = nullptr;  ///< null: loads are not watched
  const BodyTable* table = nullptr;
  const SolverBody* bodies = nullptr;
  const Velocity* before = nullptr;  ///< velocities at the start of the step
  std::span<const float> heaviest;   ///< by slot (kg), of a body's structure; 0 for bodies without support
  float least = 0;                   ///< m/s; impulses that change velocities by less are ignored, whatever the bodies
  float unit = 0;                    ///< m/s, for a contact that carries its own bodies' weight
  float stiffness = 0;               ///< 1/m, see `sweep_load`
  float dt = 0;                      ///< s
  const LinkContacts* link_contacts = nullptr;  ///< null if mechanisms solve none

  /// Notes the load of a contact that gave `impulse` (N·s) along its normal over the step; `slide` is its surfaces'
  /// contribution to the sliding velocity (m/s). `is_linked`: a mechanism solves it.
  void look_at(std::uint32_t a, std::uint32_t b, float impulse, Vec3 slide, bool is_linked) const;
  /// The contact's next lift, at a depth (m) and with a lift (m; dynamics/lift.hpp).
  float next_lift(float lift, std::uint32_t a, std::uint32_t b, float depth, float impulse, Vec3 slide) const;

 private:
  float inverse_mass(std::uint32_t slot) const;
  float thinner_half(std::uint32_t a, std::uint32_t b) const;
  /// Whether the bodies move relative to each other by more than `speed` (m/s).
  bool is_moving(std::uint32_t a, std::uint32_t b, Vec3 slide, float speed) const;
};

class ContactGraph;
/// `ContactGraph::surface_slide` and `ContactGraph::friction_ellipse`.
Vec3 surface_slide(const ContactGraph& graph, std::uint32_t contact);
FrictionEllipse friction_ellipse(const ContactGraph& graph, std::uint32_t contact, Vec3 normal);

/// Constraints, and their data that outlasts a step.
struct Constrained {
  Contact* contacts = nullptr;
  ContactManifold* manifolds = nullptr;
  const Joint* joints = nullptr;
  JointImpulse* joint_impulses = nullptr;
  const GenericJoint* generic_joints = nullptr;  ///< by slot, as impulses; null without generic joints
  GenericImpulse* generic_impulses = nullptr;
  const ContactGraph* graph = nullptr;  ///< source of moving surfaces
  TouchWatch touches{};
};

/// Blocks of one width. Restitution data is stored separately, and only if anything bounces. A block ends with inertia
/// tensors, then rolling resistance or moving surfaces; it ends before them if all bodies are isotropic, or if nothing
/// rolls or has a moving surface.
struct BlockArray {
  std::byte* blocks = nullptr;
  float* bounces = nullptr;
  std::size_t stride = 0;     ///< bytes from block to block
  std::size_t fetch_end = 0;  ///< end of the blocks whose bodies may be prefetched, even beyond the requested range
  bool shared = false;        ///< several threads write the bodies alternately
  bool scattered = false;     ///< constraint sources are in other threads' caches, or in no near one
};

/// A block is `width` constraints of one colour, stored by component: this header, then `width` indices of A, of B and
/// of the contact, then the floats.
struct BlockHeader {
  ConstraintKind kind = ConstraintKind::contact;  ///< of all lanes
  std::uint8_t lanes = 0;                         ///< in use
  std::uint8_t max_points = 0;                    ///< of any lane
  bool fixed_a = false;                           ///< no lane's A can be pushed
  bool still_a = false;                           ///< … nor moves by itself
  bool isotropic = false;                         ///< all bodies' inertias are multiples of the identity
  bool restitution = false;                       ///< some lane bounces
  bool own_softness = false;                      ///< some lane is unlike others (`ContactHold`)
  bool rare = false;                              ///< `own_softness` or `by_direction`
  bool has_offsets = false;                       ///< some lane's depth has an offset
  bool deep = false;                              ///< some lane may be deeper than allowed
  bool round = false;                             ///< some lane's contact has a round body
  bool rolls = false;                             ///< some lane has rolling resistance
  bool surface = false;                           ///< some lane has a `ContactSurface` that counts
  bool by_direction = false;                      ///< some lane's friction depends on direction
  bool ahead = false;                             ///< some lane's manifold was made where its bodies will meet
  bool moves = false;                             ///< some lane is a joint with a limit or a drive
  bool reacts = false;                            ///< … with an armature or restitution
  // Bits by lane.
  std::uint16_t in_touch = 0;  ///< touched so far
  std::uint16_t hits = 0;      ///< the last step's hit continues
  std::uint16_t near = 0;      ///< near enough to touch as the step began
  std::uint16_t closing = 0;   ///< approached faster than the hit threshold then
};

struct SolverKernels {
  const char* name;  ///< of the instruction set
  int width;         ///< lanes
  std::size_t block_bytes;
  std::size_t isotropic_block_bytes;  ///< of a block without inertia tensors or own softness
  std::size_t own_block_bytes;        ///< of a block without inertia tensors
  std::size_t surface_block_bytes;    ///< of a block with rolling resistance or `ContactSurface`s, including tensors
  std::size_t joint_block_bytes;      ///< of a block that may contain generic joints, including all of these
  std::size_t bounce_floats;          ///< per block

  /// Fills blocks [begin, end) from the constraints listed in `lanes` (width entries per block, all of one kind, `none`
  /// for empty lanes) and returns their number of contact points. May be repeated.
  std::size_t (*prepare)(BlockArray blocks, std::size_t begin, std::size_t end, const ConstraintRef* lanes,
                         const Constrained& constrained, const BodiesView& view);
  /// The sweeps over blocks of one colour.
  void (*warm_start)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies);
  /// Without warm starting: clears impulses.
  void (*clear)(BlockArray blocks, std::size_t begin, std::size_t end);
  void (*solve)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies, const SweepParameters& p);
  void (*relax)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies, const SweepParameters& p);
  void (*bounce)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies, const SweepParameters& p);
  /// `impulse` solver: friction, then penetration as a velocity bias, in one sweep.
  void (*iterate)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies, const SweepParameters& p);
  /// Sweeps over couplings only, after the same pass over everything.
  void (*solve_couplings)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies,
                          const SweepParameters& p);
  void (*relax_couplings)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies,
                          const SweepParameters& p);
  void (*iterate_couplings)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies,
                            const SweepParameters& p);
  /// Stores accumulated impulses to the manifolds, and the step's offsets (`Slack::offset`) to the contacts. Notes
  /// touches and hits. Call before bodies are moved.
  void (*store)(BlockArray blocks, std::size_t begin, std::size_t end, const ConstraintRef* lanes,
                const Constrained& constrained, float overlap_kept, const LoadWatch& watch);
};

/// The kernels for this machine, and one-lane kernels for constraints without a colour.
const SolverKernels& wide_kernels();
const SolverKernels& single_kernels();

/// Names of the instruction sets that this machine can run, widest first, and a way to force one (for tests). Not
/// thread-safe; affects worlds created afterwards. Null restores the default; returns false for an unknown name.
bool select_kernels(const char* name);

}  // namespace fathom::native
