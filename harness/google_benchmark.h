// Google Benchmark's own reports, made from records: for tools that read its JSON or CSV.
#pragma once

#include <map>
#include <span>
#include <string>

#include "harness/point.h"

namespace rasterbench {

/// The text that Google Benchmark's reporter of `format` ("json", "csv", "console") prints for these records:
/// every sample a repetition, then its aggregates mean, median and stddev. Failed and skipped points are
/// reported as errors.
std::string google_benchmark_report(std::span<const Json> records, const std::string& format,
                                    const std::map<std::string, std::string>& custom_context);

}  // namespace rasterbench
