#include "engine/log.hpp"

#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <array>
#include <fathom/error.hpp>
#include <filesystem>
#include <mutex>
#include <optional>

#include "files/output_file.hpp"
#include "scene/suggest.hpp"

namespace fathom::engine {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 6> level_names{"trace", "debug", "info", "warning", "error", "off"};

spdlog::level::level_enum spdlog_level(LogLevel level) {
  constexpr spdlog::level::level_enum levels[] = {spdlog::level::trace, spdlog::level::debug, spdlog::level::info,
                                                  spdlog::level::warn,  spdlog::level::err,   spdlog::level::off};
  return levels[static_cast<int>(level)];
}

/// A file that later runs continue. A full file becomes log.1.txt, which becomes log.2.txt. A file that is not regular
/// has no size limit and keeps its name.
class FileSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit FileSink(const LogSettings& settings)
      : path_(settings.file), max_bytes_(std::uintmax_t(settings.file_size) << 20), files_(settings.files) {
    file_.emplace(path_, files::Writing::appended);
    if (file_->is_regular()) bytes_ = fs::file_size(file_->target());
  }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    if (file_ && file_->is_regular() && bytes_ > 0 && bytes_ + line.size() > max_bytes_) rotate();
    if (!file_) return;
    file_->write(line.data(), line.size());
    bytes_ += line.size();
  }
  void flush_() override {
    if (file_) file_->flush();
  }

  void rotate() {
    const std::string target = file_->target();
    file_->flush();
    file_.reset();
    std::error_code kept;  // a file that cannot be renamed is overwritten
    for (int i = files_; i > 0; --i) fs::rename(name(target, i - 1), name(target, i), kept);
    file_.emplace(target, files::Writing::live);
    bytes_ = 0;
  }
  static fs::path name(const fs::path& target, int number) {
    if (number == 0) return target;
    return target.parent_path() / (target.stem().string() + "." + std::to_string(number) + target.extension().string());
  }

  std::string path_;
  std::uintmax_t max_bytes_, bytes_ = 0;
  int files_;
  std::optional<files::OutputFile> file_;
};

}  // namespace

LogLevel log_level_named(std::string_view name) {
  for (std::size_t i = 0; i < level_names.size(); ++i)
    if (level_names[i] == name) return static_cast<LogLevel>(i);
  throw Error(ErrorCode::invalid_argument,
              "there is no log level '" + std::string(name) + "'" + suggestion(name, level_names));
}

Log::Log(const LogSettings& settings) {
  std::vector<spdlog::sink_ptr> sinks;
  // stdout is for output to other programs; messages must not mix with it.
  if (settings.console) sinks.push_back(std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  if (!settings.file.empty()) sinks.push_back(std::make_shared<FileSink>(settings));
  logger_ = std::make_unique<spdlog::logger>("fathom", sinks.begin(), sinks.end());
  logger_->set_level(spdlog_level(settings.level));
  logger_->set_pattern("%Y-%m-%d %H:%M:%S.%e %^%-7l%$ %v");
  logger_->flush_on(spdlog::level::warn);
}

Log::~Log() = default;

bool Log::wants(LogLevel level) const { return logger_->should_log(spdlog_level(level)); }
void Log::write(LogLevel level, std::string_view text) {
  logger_->log(spdlog_level(level), spdlog::string_view_t(text.data(), text.size()));
}
void Log::flush() { logger_->flush(); }

}  // namespace fathom::engine
