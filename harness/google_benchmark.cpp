#include "harness/google_benchmark.h"

#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <numeric>
#include <set>
#include <sstream>
#include <vector>

#include "harness/statistics.h"

namespace rasterbench {
namespace {

using Reporter = benchmark::BenchmarkReporter;

std::unique_ptr<Reporter> make_reporter(const std::string& format) {
  if (format == "csv") {
    // Deprecated by the library for humans, still what --benchmark_out_format=csv means.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
    return std::make_unique<benchmark::CSVReporter>();
#pragma GCC diagnostic pop
  }
  if (format == "console")
    return std::make_unique<benchmark::ConsoleReporter>(benchmark::ConsoleReporter::OO_None);
  return std::make_unique<benchmark::JSONReporter>();
}

Reporter::Run named_run(const Json& record) {
  Reporter::Run run;
  run.run_name.function_name = record.at("name");
  run.time_unit = benchmark::kMillisecond;
  run.family_index = 0;  // the library leaves these to chance
  run.per_family_instance_index = 0;
  run.iterations = 1;
  run.threads = record.at("config").at("threads");
  return run;
}

Reporter::Run aggregate(const Json& record, const std::string& name, double ms) {
  Reporter::Run run = named_run(record);
  run.run_type = Reporter::Run::RT_Aggregate;
  run.aggregate_name = name;
  run.aggregate_unit = benchmark::kTime;
  run.real_accumulated_time = ms / 1e3;
  return run;
}

std::vector<Reporter::Run> runs_of(const Json& record) {
  const auto samples = record.at("samples_ms").get<std::vector<double>>();
  std::vector<Reporter::Run> runs;
  if (samples.empty()) {
    Reporter::Run run = named_run(record);
    run.error_occurred = true;
    run.error_message = record.value("status", "failed") + ": " + record.value("reason", "");
    return {run};
  }
  const auto n = static_cast<double>(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    Reporter::Run run = named_run(record);
    run.repetitions = static_cast<std::int64_t>(samples.size());
    run.repetition_index = static_cast<std::int64_t>(i);
    run.real_accumulated_time = samples[i] / 1e3;
    runs.push_back(run);
  }
  const double mean = std::accumulate(samples.begin(), samples.end(), 0.0) / n;
  double squares = 0;
  for (const double sample : samples) squares += (sample - mean) * (sample - mean);
  runs.push_back(aggregate(record, "mean", mean));
  runs.push_back(aggregate(record, "median", median(samples)));
  if (samples.size() > 1) runs.push_back(aggregate(record, "stddev", std::sqrt(squares / (n - 1))));
  return runs;
}

}  // namespace

std::string google_benchmark_report(std::span<const Json> records, const std::string& format,
                                    const std::map<std::string, std::string>& custom_context) {
  static std::set<std::string> added;  // the library's own list is global and refuses a key twice
  for (const auto& [key, value] : custom_context)
    if (added.insert(key).second) benchmark::AddCustomContext(key, value);
  const auto reporter = make_reporter(format);
  std::ostringstream text;
  reporter->SetOutputStream(&text);
  reporter->SetErrorStream(&text);
  Reporter::Context context;
  context.name_field_width = 0;  // Google Benchmark 1.7.1 leaves it as it finds it
  for (const Json& record : records)
    context.name_field_width =
        std::max(context.name_field_width, record.at("name").get<std::string>().size());
  reporter->ReportContext(context);
  for (const Json& record : records) reporter->ReportRuns(runs_of(record));
  reporter->Finalize();
  return text.str();
}

}  // namespace rasterbench
