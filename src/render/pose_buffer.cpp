#include "render/pose_buffer.hpp"

#include <algorithm>
#include <cstring>
#include <fathom/error.hpp>

namespace fathom::render {
namespace {

constexpr std::size_t alignment = 256;  // the largest GL_SHADER_STORAGE_BUFFER_OFFSET_ALIGNMENT allowed

std::size_t with_room(std::size_t bytes) {
  const std::size_t wanted = std::max<std::size_t>(bytes + bytes / 4, alignment);
  return (wanted + alignment - 1) / alignment * alignment;
}

}  // namespace

void PoseBuffer::make_ring(std::size_t bytes) {
  for (int part = 0; part < parts; ++part) wait(part);
  part_bytes_ = with_room(bytes);
  ring_ = make_buffer();
  const auto size = static_cast<GLsizeiptr>(parts * part_bytes_);
  const GLbitfield access = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  glNamedBufferStorage(ring_.get(), size, nullptr, access);
  mapped_ = static_cast<std::uint8_t*>(glMapNamedBufferRange(ring_.get(), 0, size, access));
  if (!mapped_) throw Error(ErrorCode::capacity, "the GPU has no memory for the poses; draw fewer bodies");
}

void PoseBuffer::wait(int part) {
  if (!fences_[part]) return;
  const GLuint64 second = 1'000'000'000;
  while (glClientWaitSync(fences_[part], GL_SYNC_FLUSH_COMMANDS_BIT, second) == GL_TIMEOUT_EXPIRED) {
  }
  glDeleteSync(fences_[part]);
  fences_[part] = nullptr;
}

void PoseBuffer::write(std::span<const Pose> poses) {
  from_device_ = false;
  if (!ring_ || poses.size_bytes() > part_bytes_) make_ring(poses.size_bytes());
  part_ = (part_ + 1) % parts;
  wait(part_);
  if (!poses.empty()) std::memcpy(mapped_ + part_ * part_bytes_, poses.data(), poses.size_bytes());
}

void PoseBuffer::write(const DevicePoses& poses) {
  const std::size_t bytes = poses.count * sizeof(Pose);
  if (!device_path_ || bytes > device_bytes_ || poses.device != device_) {
    device_path_.reset();
    device_bytes_ = with_room(bytes);
    device_ = poses.device;
    device_buffer_ = make_buffer();
    glNamedBufferData(device_buffer_.get(), static_cast<GLsizeiptr>(device_bytes_), nullptr, GL_DYNAMIC_DRAW);
    device_path_ = make_device_path(device_buffer_.get(), device_bytes_, device_, allow_sharing_);
    if (!device_path_) {
      throw Error(ErrorCode::unavailable,
                  "poses on a CUDA device need a build with CUDA; configure with -DFATHOM_CUDA=ON");
    }
  }
  from_device_ = true;
  device_path_->copy(poses);
}

void PoseBuffer::bind(GLuint binding) const {
  if (from_device_) {
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, device_buffer_.get());
  } else if (ring_) {
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, binding, ring_.get(), static_cast<GLintptr>(part_ * part_bytes_),
                      static_cast<GLsizeiptr>(part_bytes_));
  }
}

void PoseBuffer::drawn() {
  if (from_device_ || !ring_) return;
  if (fences_[part_]) glDeleteSync(fences_[part_]);
  fences_[part_] = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
}

}  // namespace fathom::render
