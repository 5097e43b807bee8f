// An OpenGL context without a window.
#pragma once

#include <memory>
#include <string>

namespace fathom::render {

/// Which graphics device draws.
struct GpuChoice {
  /// `automatic`: the first GPU that offers OpenGL 4.5, or software if there is none.
  enum class Kind { automatic, software, numbered } kind = Kind::automatic;
  int number = 0;  ///< of EGL's devices, from 0
};

/// "auto", "software" or a device's number. Throws `Error{invalid_argument}`.
GpuChoice parse_gpu(const std::string& text);

/// Current on its creating thread until it is destroyed.
class OffscreenContext {
 public:
  virtual ~OffscreenContext() = default;
  /// CUDA's number of the rendering device, or −1 if it is not a CUDA device.
  virtual int cuda_device() const = 0;
};

/// A surfaceless EGL context. Throws `Error{unavailable}` if there is no EGL, no such device or no OpenGL 4.5.
std::unique_ptr<OffscreenContext> make_offscreen_context(const GpuChoice& choice = {});

}  // namespace fathom::render
