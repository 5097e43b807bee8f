// CUDA–OpenGL interoperability (CUDA Runtime API, section 6.19).
#include <epoxy/gl.h>
// In this order: CUDA's header would include the system's own gl.h.
#include <cuda_gl_interop.h>
#include <cuda_runtime_api.h>

#include <algorithm>
#include <fathom/error.hpp>
#include <string>

#include "render/pose_buffer.hpp"

namespace fathom::render {
namespace {

void check(cudaError_t status, const char* what) {
  if (status == cudaSuccess) return;
  throw Error(ErrorCode::unavailable, std::string("drawing from CUDA: ") + what + ": " + cudaGetErrorString(status));
}

/// Whether the current OpenGL context is on the current CUDA device.
bool same_device() {
  int current = -1;
  unsigned count = 0;
  int devices[16];
  if (cudaGetDevice(&current) != cudaSuccess) return false;
  if (cudaGLGetDevices(&count, devices, 16, cudaGLDeviceListAll) != cudaSuccess) {
    cudaGetLastError();  // clears the error, which the next call would otherwise report
    return false;
  }
  return std::find(devices, devices + count, current) != devices + count;
}

class SharedPath final : public DevicePath {
 public:
  explicit SharedPath(unsigned buffer) {
    check(cudaGraphicsGLRegisterBuffer(&resource_, buffer, cudaGraphicsRegisterFlagsWriteDiscard),
          "the buffer cannot be shared");
  }
  ~SharedPath() override { cudaGraphicsUnregisterResource(resource_); }
  SharedPath(const SharedPath&) = delete;
  SharedPath& operator=(const SharedPath&) = delete;

  void copy(const DevicePoses& source) override {
    check(cudaSetDevice(source.device), "the device cannot be used");
    auto* stream = static_cast<cudaStream_t>(source.stream);
    check(cudaGraphicsMapResources(1, &resource_, stream), "the buffer cannot be mapped");
    void* target = nullptr;
    std::size_t bytes = 0;
    check(cudaGraphicsResourceGetMappedPointer(&target, &bytes, resource_), "the buffer has no address");
    check(cudaMemcpyAsync(target, source.poses, source.count * sizeof(Pose), cudaMemcpyDeviceToDevice, stream),
          "the poses cannot be copied");
    // Orders the copy before later OpenGL commands.
    check(cudaGraphicsUnmapResources(1, &resource_, stream), "the buffer cannot be given back");
  }
  bool shared() const override { return true; }

 private:
  cudaGraphicsResource_t resource_ = nullptr;
};

class HostPath final : public DevicePath {
 public:
  HostPath(unsigned buffer, std::size_t bytes) : buffer_(buffer) {
    check(cudaMallocHost(&staging_, bytes), "no pinned memory");
  }
  ~HostPath() override { cudaFreeHost(staging_); }
  HostPath(const HostPath&) = delete;
  HostPath& operator=(const HostPath&) = delete;

  void copy(const DevicePoses& source) override {
    check(cudaSetDevice(source.device), "the device cannot be used");
    auto* stream = static_cast<cudaStream_t>(source.stream);
    const std::size_t bytes = source.count * sizeof(Pose);
    check(cudaMemcpyAsync(staging_, source.poses, bytes, cudaMemcpyDeviceToHost, stream), "the poses cannot be read");
    check(cudaStreamSynchronize(stream), "the poses cannot be read");
    glNamedBufferSubData(buffer_, 0, static_cast<GLsizeiptr>(bytes), staging_);
  }
  bool shared() const override { return false; }

 private:
  unsigned buffer_;
  void* staging_ = nullptr;
};

}  // namespace

std::unique_ptr<DevicePath> make_device_path(unsigned buffer, std::size_t bytes, int device, bool allow_sharing) {
  check(cudaSetDevice(device), "the device cannot be used");
  if (allow_sharing && same_device()) {
    try {
      return std::make_unique<SharedPath>(buffer);
    } catch (const Error&) {
      cudaGetLastError();  // the path through the host always works
    }
  }
  return std::make_unique<HostPath>(buffer, bytes);
}

}  // namespace fathom::render
