// Collision detection only, on a device, for the hybrid simulator (src/hybrid). Bodies are identified by slot.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "collision/manifold.hpp"
#include "device/contact_arrays.hpp"
#include "exec/device.hpp"
#include "world/body_table.hpp"
#include "world/simulator.hpp"

namespace fathom::device {

/// A body's box for the broad phase.
struct alignas(16) BoxUpdate {
  Vec3 lower{3e38f, 3e38f, 3e38f};  ///< m; above `upper`: the slot holds no body
  std::uint32_t slot = 0;
  Vec3 upper{-3e38f, -3e38f, -3e38f};
  std::uint32_t is_new = 0;  ///< 1: pairs with it are searched
};

/// Two shapes whose manifold is wanted.
struct alignas(16) CollideJob {
  Pose b_in_a;
  std::uint32_t a = 0, b = 0;  ///< slots
  float margin = 0;            ///< m
  AxisCache axis;
  PatchLoad load;
};
struct alignas(16) CollideResult {
  Manifold manifold;
  AxisCache axis;
};

class Detection {
 public:
  /// Parts of the narrow phase that may be in progress at the same time.
  static constexpr std::uint32_t portions = 4;

  virtual ~Detection() = default;
  virtual std::string hardware() const = 0;

  /// Shape and motion type of the body in `slot`, uploaded with the next search.
  virtual void set_body(std::uint32_t slot, const BodyInfo& info) = 0;
  virtual void remove_body(std::uint32_t slot) = 0;
  /// Adopts boxes and starts a search for pairs. `slots`: number of slots. `set_changed`: bodies were added or removed.
  virtual void begin_search(std::span<const BoxUpdate> boxes, std::uint32_t slots, bool set_changed) = 0;
  /// Waits for the search and returns pairs whose boxes overlap, in any order, each once: with the grid only those with
  /// a new box, with the sweep all.
  virtual std::span<const PairRecord> found_pairs() = 0;

  /// Memory for `count` jobs of a portion, which the caller fills: pairs of boxes first. Valid until its `collide`.
  virtual CollideJob* jobs(std::uint32_t portion, std::uint32_t count) = 0;
  /// Starts to upload, collide and copy back; the first `boxes` jobs are pairs of boxes.
  virtual void collide(std::uint32_t portion, std::uint32_t boxes, std::uint32_t count) = 0;
  /// Waits for the results.
  virtual const CollideResult* results(std::uint32_t portion) = 0;

  virtual exec::Traffic traffic() const = 0;
  virtual std::size_t memory_bytes() const = 0;
};

/// On the device that `def.device` names. Throws `Error{unavailable}` if it does not exist.
std::unique_ptr<Detection> make_detection(const WorldDef& def);

}  // namespace fathom::device
