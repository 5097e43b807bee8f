#include "native/broad_phase.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "native/body_sides.hpp"
#include "native/pair_runs.hpp"
#include "world/filter.hpp"

namespace fathom::native {

bool BroadPhaseInput::is_wanted(std::uint32_t a, std::uint32_t b) const {
  // Most overlapping pairs are already known, so their bodies need not be read.
  if (known.contains(a, b)) return false;
  if (!state.is_dynamic(bodies, a) && !state.is_dynamic(bodies, b)) return false;
  if (!((state.flags[a] | state.flags[b]) & filtered)) return true;
  return may_collide(bodies[a], bodies[b]);
}

namespace {

class TreeBroadPhase : public BroadPhase {
 public:
  std::size_t find(const BroadPhaseInput& input, ThreadPool& pool, std::vector<std::vector<Pair>>& found) override {
    refresh(input, pool);
    // Small trees fit in the cache anyway, and the tree's order lists only bodies that can move.
    const std::size_t changed = input.changed.size();
    const bool many = changed > min_changed && changed * min_part > moving_.size();
    return many && !input.changed_at_rest ? find_in_order_of_tree(input, pool, found)
                                          : find_in_order_of_slots(input, pool, found);
  }

  bool lists_pairs_once() const override { return true; }

  void refresh(const BroadPhaseInput& input, ThreadPool& pool) override {
    const BodyBounds* bounds = input.state.bounds.data();
    const bool moving_set_changed = sides_.take(input.bodies, input.set_changes);
    bool moving_changed = !input.changed.empty();
    if (input.changed_at_rest) {
      moving_changed = false;
      for (const std::uint32_t slot : input.changed) {
        if (is_fixed(input, slot))
          sides_.fixed.note_moved(slot);
        else
          moving_changed = true;
      }
    }
    if (moving_set_changed) {
      moving_.build(sides_.moving, bounds, pool);
    } else if (moving_changed) {
      moving_.refit(bounds, pool);
      if (moving_.is_loose()) moving_.build(sides_.moving, bounds, pool);
    }
    sides_.fixed.refresh(bounds, pool);
  }

  const FixedTree* fixed() const override { return &sides_.fixed; }

  void list_neighbours(std::vector<std::uint32_t>& slots) const override {
    slots.insert(slots.end(), moving_.leaves().begin(), moving_.leaves().end());
  }
  std::uint64_t order() const override { return moving_.times_built(); }

  std::size_t memory_bytes() const override {
    return moving_.memory_bytes() + sides_.fixed.memory_bytes() + runs_.memory_bytes() +
           sides_.moving.capacity() * sizeof(std::uint32_t);
  }

  void save(ByteWriter& write) const override {
    sides_.save(write);
    moving_.save(write);
  }

  void restore(ByteReader& in, std::span<const BodyBounds> bounds, ThreadPool& pool) override {
    sides_.restore(in, bounds, pool);
    moving_.restore(in, bounds, pool);
  }

 private:
  static constexpr std::size_t min_changed = 16, min_part = 32, many_hits = 64;

  std::size_t find_in_order_of_slots(const BroadPhaseInput& input, ThreadPool& pool,
                                     std::vector<std::vector<Pair>>& found) {
    constexpr std::size_t grain = 8;
    const auto search_for = [&](std::size_t begin, std::size_t end, auto& hits, auto& pairs) {
      search(
          input, input.changed.subspan(begin, end - begin), hits, pairs,
          [&](const Aabb& box) { moving_.overlap(box, hits); }, [](std::uint32_t, std::size_t) {});
    };
    return search_chunks(input.changed.size(), grain, pool, found, search_for);
  }

  // Neighbours search the same nodes, most of which their own thread has refitted. Results are then put into slot
  // order.
  std::size_t find_in_order_of_tree(const BroadPhaseInput& input, ThreadPool& pool,
                                    std::vector<std::vector<Pair>>& found) {
    const std::span<const std::uint32_t> leaves = moving_.leaves();
    runs_.make_room((leaves.size() + Bvh::family - 1) / Bvh::family, input.state.size());
    const auto search_for = [&](std::size_t begin, std::size_t end, auto& hits, auto& pairs) {
      const std::size_t list = begin / Bvh::family;
      std::array<std::uint32_t, Bvh::family> changed;
      std::size_t count = 0;
      for (std::size_t i = begin; i < end; ++i) {
        changed[count] = leaves[i];
        count += input.is_changed(leaves[i]);
      }
      if (count == 0) return runs_.note_list(list, 0);
      Bvh::Nearby nearby;
      moving_.list_nearby(list, nearby);
      search(
          input, std::span(changed).first(count), hits, pairs,
          [&](const Aabb& box) { moving_.overlap(box, nearby, hits); },
          [&](std::uint32_t slot, std::size_t first) { runs_.note(slot, list, first, pairs.size() - first); });
      runs_.note_list(list, pairs.size());
    };
    const std::size_t lists = search_chunks(leaves.size(), Bvh::family, pool, runs_.lists(), search_for);
    if (found.empty()) found.resize(1);
    runs_.gather(lists, input.changed, pool, found[0]);
    return 1;
  }

  /// Calls act(begin, end, hits, pairs) for chunks of [0, count), each with its own list of pairs; returns the number
  /// of chunks.
  template <class Act>
  std::size_t search_chunks(std::size_t count, std::size_t grain, ThreadPool& pool,
                            std::vector<std::vector<Pair>>& found, const Act& act) {
    const std::size_t chunks = (count + grain - 1) / grain;
    if (found.size() < chunks) found.resize(chunks);
    if (hits_.size() < chunks) hits_.resize(chunks);
    pool.for_each_chunk(count, grain, [&](std::size_t begin, std::size_t end) {
      Borrowed hits(hits_[begin / grain]);
      Borrowed pairs(found[begin / grain]);
      pairs.mine.clear();
      act(begin, end, hits.mine, pairs.mine);
    });
    return chunks;
  }

  /// Keeps a list on the working thread's stack: its size changes constantly, and other threads' lists are adjacent to
  /// it in memory.
  template <class List>
  struct Borrowed {
    explicit Borrowed(List& list) : mine(std::move(list)), home(list) {}
    ~Borrowed() { home = std::move(mine); }
    Borrowed(const Borrowed&) = delete;
    Borrowed& operator=(const Borrowed&) = delete;

    List mine;
    List& home;
  };

  static bool is_fixed(const BroadPhaseInput& input, std::uint32_t slot) {
    // Flags are cheap to read; an awake body is not fixed.
    return !(input.state.flags[slot] & awake) && input.bodies[slot].motion == MotionType::fixed;
  }

  /// Searches for at most `Bvh::family` bodies. `search_moving` finds the movable bodies that overlap a box and writes
  /// them to `hits`. Calls note(slot, first) once everything found by `slot` is in `found`, from `first` on.
  template <class SearchMoving, class Note>
  void search(const BroadPhaseInput& input, std::span<const std::uint32_t> slots, std::vector<std::uint32_t>& hits,
              std::vector<Pair>& found, const SearchMoving& search_moving, const Note& note) const {
    // All bodies search before the first looks up its known pairs, so that those can be prefetched.
    std::array<std::size_t, Bvh::family + 1> first_of;
    hits.clear();
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const std::uint32_t slot = slots[i];
      const Aabb& box = input.state.bounds[slot].fat_box;
      std::size_t count = first_of[i] = hits.size();
      search_moving(box);
      if (!is_fixed(input, slot)) sides_.fixed.overlap(box, hits);
      // If both bodies have changed, the lower slot reports the pair.
      for (std::size_t k = count; k < hits.size(); ++k) {
        const std::uint32_t other = hits[k];
        hits[count] = other;
        count += other > slot || (other != slot && !input.is_changed(other));
      }
      hits.resize(count);
      // Lists a large body's hits in slot order: its contacts will be read in that order.
      if (count - first_of[i] > many_hits)
        std::sort(hits.begin() + static_cast<std::ptrdiff_t>(first_of[i]), hits.end());
      for (std::size_t k = first_of[i]; k < count; ++k) input.known.prefetch(slot, hits[k]);
    }
    first_of[slots.size()] = hits.size();
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const std::size_t first = found.size();
      for (std::size_t k = first_of[i]; k < first_of[i + 1]; ++k)
        if (input.is_wanted(slots[i], hits[k])) found.push_back({slots[i], hits[k]});
      note(slots[i], first);
    }
  }

  Bvh moving_;
  BodySides sides_;
  std::vector<std::vector<std::uint32_t>> hits_;  // per chunk
  PairRuns runs_;
};

}  // namespace

std::unique_ptr<BroadPhase> make_tree_broad_phase() { return std::make_unique<TreeBroadPhase>(); }

}  // namespace fathom::native
