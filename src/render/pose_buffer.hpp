// The poses that the GPU draws from: one `Pose` (32 bytes) a slot, as `World::poses()` has them.
//
// Host poses are copied into a ring of three mapped parts, so that the copy of one frame does not wait for the drawing
// of the last. Device poses (CUDA on the GPU that draws) are copied within the GPU's memory and never pass through
// the host; where the two are different devices they are copied through the host instead.
#pragma once

#include <cstdint>
#include <fathom/device_poses.hpp>
#include <fathom/math.hpp>
#include <memory>
#include <span>

#include "render/gl_objects.hpp"

namespace fathom::render {

/// How device poses reach a buffer of OpenGL.
class DevicePath {
 public:
  virtual ~DevicePath() = default;
  /// Copies the poses into the buffer, in the order of the stream; drawing that is submitted later sees them.
  virtual void copy(const DevicePoses& source) = 0;
  /// False where the poses pass through the host.
  virtual bool shared() const = 0;
};

/// For the OpenGL buffer `buffer` of `bytes` bytes and poses on CUDA device `device`. `allow_sharing` false always goes
/// through the host. Null where this build has no CUDA.
std::unique_ptr<DevicePath> make_device_path(unsigned buffer, std::size_t bytes, int device, bool allow_sharing);

class PoseBuffer {
 public:
  explicit PoseBuffer(bool allow_sharing = true) : allow_sharing_(allow_sharing) {}

  void write(std::span<const Pose> poses);
  /// Throws `Error{unavailable}` where this build has no CUDA.
  void write(const DevicePoses& poses);
  /// Binds what was written last as storage buffer `binding`.
  void bind(GLuint binding) const;
  /// To be called when the drawing that reads the poses has been submitted.
  void drawn();
  /// True where the poses that were written last did not pass through the host.
  bool shared() const { return from_device_ && device_path_->shared(); }

 private:
  static constexpr int parts = 3;
  void make_ring(std::size_t bytes);
  void wait(int part);

  bool allow_sharing_;
  GlBuffer ring_;
  std::uint8_t* mapped_ = nullptr;
  std::size_t part_bytes_ = 0;
  int part_ = 0;
  GLsync fences_[parts] = {};

  GlBuffer device_buffer_;
  std::size_t device_bytes_ = 0;
  int device_ = -1;
  std::unique_ptr<DevicePath> device_path_;
  bool from_device_ = false;
};

}  // namespace fathom::render
