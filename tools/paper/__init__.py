"""The paper's figures, drawn from our own models, and the page that compares them: `make paper`."""
