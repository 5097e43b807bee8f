// The subcommands. Each returns the program's exit code, and throws `Error` on failure.
#pragma once

#include "options.hpp"

namespace fathom::cli {

struct BenchOptions;
struct RenderOptions;
struct ViewOptions;

int list();
int devices();
int run(const RunOptions& options);
int play(const RunOptions& options);
int render(const RenderOptions& options);
int view(const ViewOptions& options);
/// Prints the effective configuration with the origin of each value, or writes it to a file.
int config(const ConfigOptions& options);
int table(const TableOptions& options);
int save_shape(const SaveShapeOptions& options);
int bench(const BenchOptions& options);
int validate(const ValidateOptions& options);
/// Writes a folder for an error report.
int bug_report(const BugReportOptions& options);

}  // namespace fathom::cli
