// The loops over blocks of contact constraints, in the widest vectors the machine has.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "dynamics/softness.hpp"
#include "dynamics/solver_body.hpp"
#include "native/contact.hpp"

namespace fathom::native {

struct SweepParameters {
  float substep = 0, inverse_substep = 0;  ///< s, 1/s
  ContactSoftness contacts;
  float push_out_velocity = 0;
  float restitution_threshold = 0;
  bool ends_substep = false;            ///< of `iterate`: the last sweep of a substep
  std::atomic<bool>* struck = nullptr;  ///< of `strike`: set where something did
};

/// What `prepare` reads beside the contacts; all by slot.
struct BodiesView {
  const Pose* poses = nullptr;
  SolverBody* bodies = nullptr;
  const WorldInertia* inertias = nullptr;
  const BodyMotion* motion = nullptr;
  float overlap_kept = 1;  ///< a step (dynamics/overlap.hpp)
};

/// Constraints and manifolds they are made from.
struct Constrained {
  Contact* contacts = nullptr;
  ContactManifold* manifolds = nullptr;
};

/// Blocks of one width. What bouncing needs is kept apart, and not at all where nothing bounces; inertia tensors and
/// rolling resistance come last in a block, which ends before them where all bodies are isotropic, or nothing has any.
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
  std::uint8_t lanes = 0;       ///< in use
  std::uint8_t max_points = 0;  ///< of any lane
  bool fixed_a = false;         ///< no lane's A can be pushed
  bool still_a = false;         ///< … nor moves by itself
  bool isotropic = false;       ///< all bodies' inertias are multiples of the identity
  bool restitution = false;     ///< some lane bounces
  bool round = false;           ///< some lane is a contact of something round
  bool rolls = false;           ///< some lane has rolling resistance
};

/// Columns side by side, one a lane (dynamics/columns.hpp). Arrays have `width` entries a row; lanes beyond `used` are
/// empty columns.
struct ColumnBundle {
  std::uint32_t contacts = 0;              ///< of the tallest
  const std::uint32_t* lengths = nullptr;  ///< contacts of each lane's column
  const std::uint32_t* bodies = nullptr;   ///< slots from the base up, `none` beyond the top; contacts + 1 rows
  const std::uint32_t* lanes = nullptr;    ///< of all blocks' lanes, the contact above each body; any beyond the top
  const float* up = nullptr;               ///< 1 where B of that contact is above, else −1
  float* work = nullptr;                   ///< aligned; contacts + 1 times `column_floats`
};

struct SolverKernels {
  const char* name;  ///< of the instruction set
  int width;         ///< lanes
  std::size_t block_bytes;
  std::size_t isotropic_block_bytes;  ///< of a block without inertia tensors
  std::size_t rolling_block_bytes;    ///< of a block with rolling resistance, and them
  std::size_t bounce_floats;          ///< a block
  std::size_t column_floats;          ///< a row of columns

  /// Fills blocks [begin, end) from the contacts listed in `lanes` (width entries a block, `none` for empty lanes) and
  /// returns how many points they have.
  std::size_t (*prepare)(BlockArray blocks, std::size_t begin, std::size_t end, const std::uint32_t* lanes,
                         const Constrained& constrained, const BodiesView& view);
  /// The sweeps over blocks of one colour.
  void (*warm_start)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies);
  /// Without warm starting: no impulses.
  void (*clear)(BlockArray blocks, std::size_t begin, std::size_t end);
  void (*solve)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies, const SweepParameters& p);
  void (*relax)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies, const SweepParameters& p);
  void (*strike)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies, const SweepParameters& p);
  /// `impulse` solver: friction, then penetration as a velocity bias, in one sweep.
  void (*iterate)(BlockArray blocks, std::size_t begin, std::size_t end, SolverBody* bodies, const SweepParameters& p);
  /// Reads what stays the same in all braces of a step, after `prepare`.
  void (*load_columns)(BlockArray blocks, const ColumnBundle& columns, const BodiesView& view,
                       const SweepParameters& p);
  /// Braces columns (dynamics/columns.hpp).
  void (*brace)(BlockArray blocks, const ColumnBundle& columns, const BodiesView& view, bool pushes_out,
                const SweepParameters& p);
  /// Writes accumulated impulses back to the manifolds.
  void (*store)(BlockArray blocks, std::size_t begin, std::size_t end, const Constrained& constrained);
};

/// The kernels for this machine, and the same one lane wide for constraints that no colour could take.
const SolverKernels& wide_kernels();
const SolverKernels& single_kernels();

/// Names of the instruction sets this machine can run, widest first, and a way to insist on one (for tests).
/// Not thread-safe; affects worlds created afterwards. Null restores the default; returns false where unknown.
bool select_kernels(const char* name);

}  // namespace fathom::native
