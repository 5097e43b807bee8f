#include "engine/log.hpp"

#include <spdlog/sinks/rotating_file_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <array>
#include <fathom/error.hpp>
#include <filesystem>

#include "scene/suggest.hpp"

namespace fathom::engine {
namespace {

constexpr std::array<std::string_view, 6> level_names{"trace", "debug", "info", "warning", "error", "off"};

spdlog::level::level_enum spdlog_level(LogLevel level) {
  constexpr spdlog::level::level_enum levels[] = {spdlog::level::trace, spdlog::level::debug, spdlog::level::info,
                                                  spdlog::level::warn,  spdlog::level::err,   spdlog::level::off};
  return levels[static_cast<int>(level)];
}

}  // namespace

LogLevel log_level_named(std::string_view name) {
  for (std::size_t i = 0; i < level_names.size(); ++i)
    if (level_names[i] == name) return static_cast<LogLevel>(i);
  throw Error(ErrorCode::invalid_argument,
              "there is no log level '" + std::string(name) + "'" + suggestion(name, level_names));
}

Log::Log(const LogSettings& settings) {
  std::vector<spdlog::sink_ptr> sinks;
  // What a program prints for others to read goes to stdout; messages do not mix with it.
  if (settings.console) sinks.push_back(std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  if (!settings.file.empty()) {
    try {
      // spdlog would make the folder.
      const auto folder = std::filesystem::absolute(settings.file).parent_path();
      if (!std::filesystem::is_directory(folder)) throw spdlog::spdlog_ex("no such folder");
      sinks.push_back(std::make_shared<spdlog::sinks::rotating_file_sink_mt>(
          settings.file, static_cast<std::size_t>(settings.file_size) << 20, static_cast<std::size_t>(settings.files)));
    } catch (const spdlog::spdlog_ex&) {
      throw Error(ErrorCode::file, settings.file + ": the log cannot be written; check the folder and its permissions");
    }
  }
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
