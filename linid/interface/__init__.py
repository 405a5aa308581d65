"""What the public interface is made of: settings, campaigns, stages of a fit, measures, results."""
