"""The statistics of the report. Intervals assume no distribution of the times, nor do tests if the samples suffice."""
