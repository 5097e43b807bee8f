// Poses in a GPU simulator's own memory, for code that draws or reads on the same GPU.
#pragma once

#include <cstddef>

namespace fathom {

/// Poses in the memory of a device. Valid until the next step or change of the world.
struct DevicePoses {
  const void* poses = nullptr;   ///< device pointer to `count` Poses of 32 bytes, by `BodyId::index`
  std::size_t count = 0;         ///< slots; undefined in those without a body
  void* stream = nullptr;        ///< cudaStream_t whose work completes the poses
  int device = 0;                ///< the back end's device number
  const char* backend = "cuda";  ///< which back end's memory it is
};

}  // namespace fathom
