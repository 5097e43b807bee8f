// RAII wrappers of OpenGL objects. Each belongs to the context that is current when it is created.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/mat4.hpp"

namespace fathom::render {

/// Throws `Error{unavailable}` unless the current context offers OpenGL 4.5 and everything else the renderer needs.
void require_gl();
/// The current context's renderer and version, human-readable.
std::string gl_description();

/// An OpenGL name, freed by `Free`.
template <class Free>
class GlName {
 public:
  GlName() = default;
  explicit GlName(GLuint name) : name_(name) {}
  ~GlName() {
    if (name_ != 0) Free{}(name_);
  }
  GlName(GlName&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlName& operator=(GlName&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  GLuint get() const { return name_; }
  explicit operator bool() const { return name_ != 0; }

 private:
  GLuint name_ = 0;
};

struct FreeBuffer {
  void operator()(GLuint name) const { glDeleteBuffers(1, &name); }
};
struct FreeTexture {
  void operator()(GLuint name) const { glDeleteTextures(1, &name); }
};
struct FreeRenderbuffer {
  void operator()(GLuint name) const { glDeleteRenderbuffers(1, &name); }
};
struct FreeFramebuffer {
  void operator()(GLuint name) const { glDeleteFramebuffers(1, &name); }
};
struct FreeVertexArray {
  void operator()(GLuint name) const { glDeleteVertexArrays(1, &name); }
};
struct FreeProgram {
  void operator()(GLuint name) const { glDeleteProgram(name); }
};
using GlBuffer = GlName<FreeBuffer>;
using GlTexture = GlName<FreeTexture>;
using GlRenderbuffer = GlName<FreeRenderbuffer>;
using GlFramebuffer = GlName<FreeFramebuffer>;
using GlVertexArray = GlName<FreeVertexArray>;
using GlProgram = GlName<FreeProgram>;

GlBuffer make_buffer();
GlTexture make_texture(GLenum target);
GlRenderbuffer make_renderbuffer();
GlFramebuffer make_framebuffer();
GlVertexArray make_vertex_array();

/// A buffer that never changes.
template <class T>
GlBuffer make_buffer_of(const std::vector<T>& values) {
  GlBuffer buffer = make_buffer();
  glNamedBufferStorage(buffer.get(), static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data(), 0);
  return buffer;
}

/// A buffer that grows; every write replaces the whole content.
class GrowingBuffer {
 public:
  void write(const void* data, std::size_t bytes);
  GLuint get() const { return buffer_.get(); }

 private:
  GlBuffer buffer_;
  std::size_t capacity_ = 0;
};

/// Compiles and links. `defines` follow the version line. Throws `std::runtime_error` with the driver's log: a shader
/// that does not compile is a bug of this program or of the driver.
GlProgram make_program(std::string_view name, std::string_view defines, std::string_view vertex,
                       std::string_view fragment);

}  // namespace fathom::render
