// The poses that the GPU draws from: one `Pose` (32 bytes) per slot, as in `World::poses()`.
//
// Host poses are copied into a triple-buffered ring of mapped memory, so copying a frame does not wait for the last one
// to be drawn. Device poses (CUDA on the rendering GPU) are copied within the GPU's memory; if the two devices differ,
// they pass through the host.
#pragma once

#include <cstdint>
#include <fathom/device_poses.hpp>
#include <fathom/math.hpp>
#include <memory>
#include <span>

#include "render/gl_objects.hpp"

namespace fathom::render {

/// How device poses reach an OpenGL buffer.
class DevicePath {
 public:
  virtual ~DevicePath() = default;
  /// Copies the poses into the buffer, in stream order; drawing submitted later sees them.
  virtual void copy(const DevicePoses& source) = 0;
  /// False if the poses pass through the host.
  virtual bool shared() const = 0;
};

/// For the OpenGL buffer `buffer` of `bytes` bytes and poses on CUDA device `device`. If `allow_sharing` is false,
/// always through the host. Null in builds without CUDA.
std::unique_ptr<DevicePath> make_device_path(unsigned buffer, std::size_t bytes, int device, bool allow_sharing);

class PoseBuffer {
 public:
  explicit PoseBuffer(bool allow_sharing = true) : allow_sharing_(allow_sharing) {}

  void write(std::span<const Pose> poses);
  /// Throws `Error{unavailable}` in builds without CUDA.
  void write(const DevicePoses& poses);
  /// Binds the last written poses as storage buffer `binding`.
  void bind(GLuint binding) const;
  /// Call after submitting the draw calls that read the poses.
  void drawn();
  /// True if the last poses did not pass through the host.
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
