#include "bench_options.hpp"

#include <CLI/CLI.hpp>

#include "validators.hpp"

namespace fathom::cli {
namespace {

using campaign::Form;

void declare_campaign(CLI::App& command, CampaignOptions& options) {
  campaign::Settings& settings = options.settings;
  const auto form = [&](const char* flag, Form value, const char* help) {
    return command.add_flag_callback(
        flag, [&settings, value] { settings.form = value; }, help);
  };
  CLI::Option* quick = form("--quick", Form::quick, "A few minutes on two cores (the default)");
  CLI::Option* full = form("--full", Form::full, "Every size, number of threads, device and set of algorithms");
  CLI::Option* huge = form("--huge", Form::huge, "Like --full, and 100,000 to 1,000,000 bodies");
  full->excludes(quick);
  huge->excludes(quick)->excludes(full);
  command.add_option("--out", options.out, "Folder for figures and report (fathom-campaign)")->type_name("DIR");
  command.add_flag("--resume", settings.resume, "Continue the campaign in the folder");
  command.add_option("--only", settings.only, "Runs whose names contain this text, as in layers-1000-native-2t-fathom")
      ->type_name("TEXT");
  command.add_option("--rounds", settings.rounds, "How many times everything runs (1)")
      ->type_name("N")
      ->check(whole_number(1, 1000));
  command.add_option("--steps", settings.limits.steps, "Steps per run (1800, 30 s as published)")
      ->type_name("N")
      ->check(whole_number(1, 1'000'000));
  command
      .add_option("--limit", settings.limits.seconds,
                  "Wall time after which a run is cut short (s; quick: 60, else 600)")
      ->type_name("S")
      ->check(positive_number());
  command.add_flag("--quiet", options.quiet, "No progress");
  command.footer(
      "Repeats chapter 4 of the dissertation on this machine and writes campaign.json, campaign.csv, a row per step\n"
      "in runs/, pictures, and report.html with the published figures for comparison. Ctrl-C keeps the runs that\n"
      "ended: --resume continues.\n"
      "Exit code: 0 all runs are reported; 1 a run was refused (states not finite, exploded); 2 the request is wrong;\n"
      "130 interrupted.");
}

void declare_compare(CLI::App& command, CompareOptions& options) {
  command.add_option("before", options.before, "campaign.json, peers.json or what bench/instructions wrote")
      ->required()
      ->type_name("A.json");
  command.add_option("after", options.after, "The same, made later")->required()->type_name("B.json");
  command
      .add_option("--noise", options.settings.noise,
                  "How far runs of one program differ (share; 0.05), where files of one round cannot tell")
      ->type_name("SHARE")
      ->check(positive_number());
  command.footer(
      "A ratio is slower or faster where its 95 % confidence interval does not contain 1. The interval comes from\n"
      "the steps of a run, second by second, and from how rounds differ (--rounds of campaign and peers). Instruction\n"
      "counts are compared with the tolerance in A.json. Runs of different lengths are compared over the seconds that\n"
      "both have, or not at all.\n"
      "Exit code: 0 nothing got worse; 1 something got slower or less stable; 2 the request is wrong, or nothing can\n"
      "be compared.");
}

}  // namespace

void declare_bench(CLI::App& command, BenchOptions& options) {
  command.require_subcommand(1);
  options.campaign.settings.limits.seconds = 0;  // depends on the form
  CLI::App* campaign = command.add_subcommand("campaign", "Repeat the published experiment and write its report");
  declare_campaign(*campaign, options.campaign);
  options.campaign_command = campaign;
  CLI::App* peers = command.add_subcommand("peers", "Compare Fathom with other engines on the same scenes");
  peers
      ->add_option("--out", options.peers.out,
                   "Folder for peers.json and the report, unless --json names a file (fathom-campaign)")
      ->type_name("DIR");
  peers::declare(*peers, options.peers.peers);
  options.peers_command = peers;
  CLI::App* compare = command.add_subcommand("compare", "Report what got slower or less stable between two results");
  declare_compare(*compare, options.compare);
  options.compare_command = compare;
  CLI::App* report = command.add_subcommand("report", "Write the report of a campaign's folder again");
  report->add_option("folder", options.report_folder, "What 'fathom bench campaign' wrote")
      ->required()
      ->type_name("DIR");
  options.report_command = report;
}

}  // namespace fathom::cli
