// A world at rest or in steady motion allocates nothing, and keeps to its memory budget.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "world_fixture.hpp"

namespace {
std::atomic<std::size_t> allocations{0};
}

// Counting replacements of the global operators: every allocation of this program passes through them. Not inlined,
// because g++ would then take the pairs of malloc and delete, new and free, for errors.
#define FATHOM_COUNTED [[gnu::noinline]]
FATHOM_COUNTED void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size ? size : 1)) return memory;
  throw std::bad_alloc();
}
FATHOM_COUNTED void* operator new(std::size_t size, std::align_val_t alignment) {
  ++allocations;
  const std::size_t a = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(a, (size + a - 1) / a * a)) return memory;
  throw std::bad_alloc();
}
FATHOM_COUNTED void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size ? size : 1);
}
FATHOM_COUNTED void operator delete(void* memory) noexcept { std::free(memory); }
FATHOM_COUNTED void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
FATHOM_COUNTED void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
FATHOM_COUNTED void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace fathom::test::steady_state_test {
namespace {

TEST(SteadyState, StepsAllocateNothing) {
  for (const BroadPhase kind : {BroadPhase::tree, BroadPhase::sweep}) {
    WorldDef def = quiet_world(2);
    def.broad_phase = kind;
    World world(def);
    world.add(ground());
    add_pyramid(world, 6);
    run(world, 60);
    const std::size_t before = allocations, held = world.profile().counts.memory_bytes;
    run(world, 120);
    EXPECT_EQ(allocations - before, 0u);
    EXPECT_EQ(world.profile().counts.memory_bytes, held);  // large arrays are allocated from the system directly
  }
}

TEST(SteadyState, MemoryPerBodyAndManifoldIsBounded) {
  WorldDef def = quiet_world();
  def.gravity = {};
  World sparse(def);
  for (int i = 0; i < 4096; ++i)
    sparse.add(
        cube({static_cast<float>(i % 16) * 4, static_cast<float>(i / 16 % 16) * 4, static_cast<float>(i / 256) * 4}));
  run(sparse, 5);
  EXPECT_LE(sparse.profile().counts.memory_bytes / 4096, 1024u);

  World dense(quiet_world());
  dense.add(ground());
  dense.reserve(1241);
  add_pyramid(dense, 15);
  run(dense, 5);
  const StepCounts& c = dense.profile().counts;
  EXPECT_LE(c.memory_bytes, 1241u * 1024 + c.manifolds * 512u);
}

}  // namespace
}  // namespace fathom::test::steady_state_test
