// Altered snapshots with a correct checksum: refused with one `Error`, or restored into a world that can be read and
// saved. (It is not stepped: a checksum detects accidents, not intentions.)
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cstring>

#include "input.hpp"
#include "worlds.hpp"

namespace {

using namespace fathom;

void repair_head(std::vector<std::byte>& bytes) {
  constexpr std::size_t head = 32;
  if (bytes.size() < head) return;
  const std::uint64_t size = bytes.size() - head, sum = XXH3_64bits(bytes.data() + head, bytes.size() - head);
  std::memcpy(bytes.data() + 16, &size, sizeof size);
  std::memcpy(bytes.data() + 24, &sum, sizeof sum);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<std::byte> sound[2] = {fuzz::snapshot(SimulatorKind::native),
                                                  fuzz::snapshot(SimulatorKind::device)};
  fuzz::Input input(data, size);
  std::vector<std::byte> bytes = sound[input.byte() % 2];
  for (int edits = 0; edits < 16 && !input.empty(); ++edits) fuzz::alter(bytes, input);
  repair_head(bytes);
  World world(fuzz::definition(SimulatorKind::native));
  try {
    world.restore(bytes);
    for (const BodyId id : world.bodies()) (void)world.pose(id);
    for (const JointId id : world.joints()) (void)world.joint_positions(id);
    std::vector<std::byte> again;
    world.save(again);
  } catch (const Error&) {
  }
  return 0;
}
