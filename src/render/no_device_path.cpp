// For builds without CUDA.
#include "render/pose_buffer.hpp"

namespace fathom::render {

std::unique_ptr<DevicePath> make_device_path(unsigned, std::size_t, int, bool) { return nullptr; }

}  // namespace fathom::render
