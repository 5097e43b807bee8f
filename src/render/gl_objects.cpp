#include "render/gl_objects.hpp"

#include <fathom/error.hpp>
#include <stdexcept>

namespace fathom::render {
namespace {

std::string text_of(GLenum name) {
  const auto* text = reinterpret_cast<const char*>(glGetString(name));
  return text ? text : "unknown";
}

std::string log_of(GLuint name, void (*get_integer)(GLuint, GLenum, GLint*),
                   void (*get_log)(GLuint, GLsizei, GLsizei*, GLchar*)) {
  GLint length = 0;
  get_integer(name, GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<std::size_t>(length), '\0');
  get_log(name, length, nullptr, log.data());
  return log;
}

GLuint compile(std::string_view program, GLenum stage, std::string_view defines, std::string_view source) {
  const std::string text = "#version 450 core\n" + std::string(defines) + std::string(source);
  const char* lines = text.c_str();
  const GLuint shader = glCreateShader(stage);
  glShaderSource(shader, 1, &lines, nullptr);
  glCompileShader(shader);
  GLint good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good) return shader;
  const std::string log = log_of(
      shader, [](GLuint n, GLenum what, GLint* value) { glGetShaderiv(n, what, value); },
      [](GLuint n, GLsizei size, GLsizei* length, GLchar* out) { glGetShaderInfoLog(n, size, length, out); });
  glDeleteShader(shader);
  throw std::runtime_error("the shader '" + std::string(program) + "' does not compile on " + gl_description() + ": " +
                           log);
}

}  // namespace

void require_gl() {
  if (epoxy_gl_version() < 45) {
    throw Error(ErrorCode::unavailable, "OpenGL 4.5 is needed, but " + gl_description() +
                                            " offers less; update the graphics driver, or draw in software with "
                                            "LIBGL_ALWAYS_SOFTWARE=1 and Mesa");
  }
  GLint blocks = 0;
  glGetIntegerv(GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS, &blocks);
  if (blocks < 3) {
    throw Error(ErrorCode::unavailable, "vertex shaders must read storage buffers, but those of " + gl_description() +
                                            " cannot; draw in software with LIBGL_ALWAYS_SOFTWARE=1 and Mesa");
  }
}

std::string gl_description() { return text_of(GL_RENDERER) + " (OpenGL " + text_of(GL_VERSION) + ")"; }

GlBuffer make_buffer() {
  GLuint name = 0;
  glCreateBuffers(1, &name);
  return GlBuffer(name);
}

GlTexture make_texture(GLenum target) {
  GLuint name = 0;
  glCreateTextures(target, 1, &name);
  return GlTexture(name);
}

GlRenderbuffer make_renderbuffer() {
  GLuint name = 0;
  glCreateRenderbuffers(1, &name);
  return GlRenderbuffer(name);
}

GlFramebuffer make_framebuffer() {
  GLuint name = 0;
  glCreateFramebuffers(1, &name);
  return GlFramebuffer(name);
}

GlVertexArray make_vertex_array() {
  GLuint name = 0;
  glCreateVertexArrays(1, &name);
  return GlVertexArray(name);
}

void GrowingBuffer::write(const void* data, std::size_t bytes) {
  if (!buffer_) buffer_ = make_buffer();
  if (bytes > capacity_) {
    capacity_ = bytes + bytes / 4;
    glNamedBufferData(buffer_.get(), static_cast<GLsizeiptr>(capacity_), nullptr, GL_DYNAMIC_DRAW);
  }
  if (bytes > 0) glNamedBufferSubData(buffer_.get(), 0, static_cast<GLsizeiptr>(bytes), data);
}

GlProgram make_program(std::string_view name, std::string_view defines, std::string_view vertex,
                       std::string_view fragment) {
  const GLuint vertex_shader = compile(name, GL_VERTEX_SHADER, defines, vertex);
  const GLuint fragment_shader = compile(name, GL_FRAGMENT_SHADER, defines, fragment);
  GlProgram program(glCreateProgram());
  for (const GLuint shader : {vertex_shader, fragment_shader}) {
    glAttachShader(program.get(), shader);
    glDeleteShader(shader);  // freed with the program
  }
  glLinkProgram(program.get());
  GLint good = 0;
  glGetProgramiv(program.get(), GL_LINK_STATUS, &good);
  if (good) return program;
  throw std::runtime_error(
      "the shader '" + std::string(name) + "' does not link on " + gl_description() + ": " +
      log_of(
          program.get(), [](GLuint n, GLenum what, GLint* value) { glGetProgramiv(n, what, value); },
          [](GLuint n, GLsizei size, GLsizei* length, GLchar* out) { glGetProgramInfoLog(n, size, length, out); }));
}

}  // namespace fathom::render
